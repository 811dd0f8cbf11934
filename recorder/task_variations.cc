#include "recorder/task_variations.h"

#include <algorithm>
#include <set>
#include <stdexcept>

#include "recorder/colors.h"

namespace flowscope {
namespace {

constexpr int kMaxVariations = 10'000;

/// A list of words, or the word `colors` for all of them.
std::vector<std::string> words(const TaskReader& reader, const TaskNode& node, const std::string& what) {
  if (node.is_scalar() && node.text == "colors") return color_names();
  std::vector<std::string> result;
  for (const auto& item : reader.list(node, what)) result.push_back(reader.text(item, what));
  if (result.empty()) reader.fail(node, "'" + what + "' is empty");
  return result;
}

std::vector<std::string> sample(std::vector<std::string> from, std::size_t count, TaskRandom& random) {
  for (std::size_t i = 0; i < count; ++i) std::swap(from[i], from[i + random.index(from.size() - i)]);
  from.resize(count);
  return from;
}

Variables numbered(const std::string& name, const std::vector<std::string>& values) {
  Variables result;
  for (std::size_t i = 0; i < values.size(); ++i) result[name + "_" + std::to_string(i + 1)] = values[i];
  return result;
}

/// A fixed selection of `take` different ordered choices: neighbours in the list look different, unlike in
/// alphabetical order.
std::vector<Variables> permutations(const TaskReader& reader, const std::string& task, const TaskNode& node) {
  reader.check_keys(node, "permutations", {"from", "choose", "take", "as"});
  const auto from = words(reader, reader.require(node, "from"), "from");
  const int size = static_cast<int>(from.size());
  const int choose = reader.integer(reader.require(node, "choose"), "choose", 1, size);
  double possible = 1;
  for (int i = 0; i < choose; ++i) possible *= size - i;
  const int most = static_cast<int>(std::min<double>(kMaxVariations, possible));
  const int take = reader.integer(reader.require(node, "take"), "take", 1, most);
  const std::string name = reader.text(reader.require(node, "as"), "as");
  TaskRandom random(task, 0, 0);
  std::set<std::vector<std::string>> seen;
  std::set<std::string> leading;
  std::vector<Variables> result;
  while (static_cast<int>(result.size()) < take) {
    const auto choice = sample(from, static_cast<std::size_t>(choose), random);
    // As long as there are fresh words, every choice begins with one: short prefixes then differ as well.
    if (leading.size() < from.size() && leading.contains(choice.front())) continue;
    leading.insert(choice.front());
    if (seen.insert(choice).second) result.push_back(numbered(name, choice));
  }
  return result;
}

std::vector<Variables> alternatives(const TaskReader& reader, const std::string& task, const TaskNode& node) {
  if (!node.is_map() || node.keys.size() != 1)
    reader.fail(node, "one 'name: [values]' or 'permutations' belongs here");
  if (node.keys[0] == "permutations") return permutations(reader, task, node.items[0]);
  std::vector<Variables> result;
  for (const auto& value : words(reader, node.items[0], node.keys[0]))
    result.push_back({{node.keys[0], value}});
  return result;
}

}  // namespace

const std::vector<std::string>& color_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> result;
    for (const auto& color : benchmark_colors) result.emplace_back(color.name);
    return result;
  }();
  return names;
}

std::array<float, 3> color_rgb(const std::string& name) {
  for (const auto& color : benchmark_colors) {
    if (name == color.name) return color.rgb;
  }
  throw std::invalid_argument("no colour is called '" + name + "'");
}

std::vector<Variables> read_variations(const TaskReader& reader, const std::string& task,
                                       const TaskNode& node) {
  reader.check_keys(node, "variations", {"combine", "limit"});
  std::vector<Variables> result{{}};
  for (const auto& item : reader.list(reader.require(node, "combine"), "combine")) {
    const auto choices = alternatives(reader, task, item);
    if (result.size() * choices.size() > kMaxVariations) reader.fail(item, "too many variations");
    std::vector<Variables> combined;
    for (const auto& base : result) {
      for (const auto& choice : choices) {
        combined.push_back(base);
        combined.back().insert(choice.begin(), choice.end());
      }
    }
    result = std::move(combined);
  }
  if (const auto* limit = node.find("limit")) {
    const int most = reader.integer(*limit, "limit", 1, kMaxVariations);
    if (result.size() > static_cast<std::size_t>(most)) result.resize(static_cast<std::size_t>(most));
  }
  return result;
}

void draw_variables(const TaskReader& reader, const TaskNode* node, TaskRandom& random,
                    Variables& variables) {
  if (!node) return;
  for (const auto& item : reader.list(*node, "draw")) {
    const TaskNode filled = reader.fill(item, variables);
    reader.check_keys(filled, "draw", {"sample", "from", "except", "as"});
    auto from = words(reader, reader.require(filled, "from"), "from");
    if (const auto* except = filled.find("except")) {
      for (const auto& word : words(reader, *except, "except")) std::erase(from, word);
    }
    const int count =
        reader.integer(reader.require(filled, "sample"), "sample", 1, static_cast<int>(from.size()));
    const auto drawn = numbered(reader.text(reader.require(filled, "as"), "as"),
                                sample(std::move(from), static_cast<std::size_t>(count), random));
    variables.insert(drawn.begin(), drawn.end());
  }
}

}  // namespace flowscope
