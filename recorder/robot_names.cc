#include "recorder/robot_names.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <numeric>
#include <utility>
#include <vector>

#include "recorder/script.h"

namespace flowscope {
namespace {

constexpr std::size_t kOffered = 3, kListed = 16;

struct Kind {
  mjtObj type;
  const char* word;
  int mjModel::*count;
};
constexpr Kind kKinds[] = {
    {mjOBJ_JOINT, "joint", &mjModel::njnt}, {mjOBJ_ACTUATOR, "actuator", &mjModel::nu},
    {mjOBJ_SITE, "site", &mjModel::nsite},  {mjOBJ_BODY, "body", &mjModel::nbody},
    {mjOBJ_GEOM, "geom", &mjModel::ngeom},  {mjOBJ_TENDON, "tendon", &mjModel::ntendon}};

const Kind& kind_of(int type) {
  const auto* found = std::find_if(std::begin(kKinds), std::end(kKinds),
                                   [type](const Kind& kind) { return kind.type == type; });
  return found == std::end(kKinds) ? kKinds[0] : *found;
}

std::vector<std::string> names(const mjModel* model, const Kind& kind) {
  std::vector<std::string> result;
  for (int id = kind.type == mjOBJ_BODY ? 1 : 0; id < model->*kind.count; ++id) {
    const char* name = mj_id2name(model, kind.type, id);
    if (name && *name) result.emplace_back(name);
  }
  return result;
}

std::string lower(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

/// Letters to be changed, added or taken away to make one name of the other.
std::size_t changes(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0u);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t changed = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = std::exchange(row[j], std::min({changed, row[j] + 1, row[j - 1] + 1}));
    }
  }
  return row.back();
}

/// The likeliest first: another spelling, or one name inside the other (a prefix that is missing or too
/// much).
std::vector<std::string> near(const std::string& wanted, const std::vector<std::string>& known) {
  std::vector<std::pair<std::size_t, std::string>> ranked;
  const std::string name = lower(wanted);
  for (const auto& candidate : known) {
    const std::string other = lower(candidate);
    const bool inside = std::min(name.size(), other.size()) >= 2 &&
                        (other.find(name) != std::string::npos || name.find(other) != std::string::npos);
    const std::size_t distance = name == other ? 0 : inside ? 1 : changes(name, other);
    if (inside || distance <= std::max<std::size_t>(1, name.size() / 3))
      ranked.emplace_back(distance, candidate);
  }
  std::ranges::stable_sort(ranked, {}, &std::pair<std::size_t, std::string>::first);
  std::vector<std::string> result;
  for (const auto& [distance, candidate] : ranked) {
    if (distance == ranked.front().first && result.size() < kOffered) result.push_back(candidate);
  }
  return result;
}

std::string joined(const std::vector<std::string>& words, std::size_t most) {
  std::string text;
  for (std::size_t i = 0; i < std::min(words.size(), most); ++i) text += (i > 0 ? ", " : "") + words[i];
  if (words.size() > most) text += " and " + std::to_string(words.size() - most) + " more";
  return text;
}

}  // namespace

int find_named(const mjModel* model, int type, const std::string& name, const RobotDescription& robot,
               const std::string& place) {
  const Kind& kind = kind_of(type);
  if (const int id = mj_name2id(model, type, name.c_str()); id >= 0) return id;
  std::string message = std::string("the scene has no ") + kind.word + " '" + name + "'";
  for (const Kind& other : kKinds) {
    if (mj_name2id(model, other.type, name.c_str()) >= 0) {
      const std::string article = other.word[0] == 'a' ? "an " : "a ";
      message += "; '" + name + "' is " + article + other.word + " there";
      break;
    }
  }
  const auto known = names(model, kind);
  if (const auto offered = near(name, known); !offered.empty()) {
    message += "; did you mean " + joined(offered, kOffered) + "?";
  }
  message += known.empty() ? std::string(" (it has no named ") + kind.word + " at all)"
                           : " (known: " + joined(known, kListed) + ")";
  throw BadScript(robot.places.of(place) + message);
}

std::string name_of(const mjModel* model, int type, int id) {
  const char* name = mj_id2name(model, type, id);
  if (name && *name) return name;
  const std::string nameless = std::string("a nameless ") + kind_of(type).word;
  if (type != mjOBJ_JOINT) return nameless;
  return nameless + " of " + name_of(model, mjOBJ_BODY, model->jnt_bodyid[id]);
}

std::string to_words(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  const std::string word = text;
  return word.starts_with('-') ? "\u2212" + word.substr(1) : word;
}

}  // namespace flowscope
