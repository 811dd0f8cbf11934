#include "app/ablate_variant.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <map>
#include <stdexcept>

namespace flowscope {
namespace {

constexpr std::size_t most_cells = 10'000;  ///< more would take years
constexpr int most_flow_steps = 1000;

std::string text_of(const std::string& value) { return value; }
std::string text_of(bool value) { return value ? "on" : "off"; }

struct GridList {
  std::vector<std::string> values;
  int line = 0;
};

class GridFile {
 public:
  explicit GridFile(const std::filesystem::path& file) : file_(file) {
    try {
      const YAML::Node root = YAML::LoadFile(file.string());
      if (!root.IsMap() || root.size() == 0)
        fail(0, "must name lists of values, such as objective: [cfm, ddim]");
      for (const auto& entry : root) {
        const auto key = entry.first.as<std::string>();
        GridList& list = lists_[key];
        if (!list.values.empty()) fail(entry.first.Mark().line, "'" + key + "' appears twice");
        list.line = entry.first.Mark().line;
        if (!entry.second.IsSequence() || entry.second.size() == 0)
          fail(list.line, "'" + key + "' is not a list of values");
        for (const auto& value : entry.second) list.values.push_back(value.as<std::string>());
      }
    } catch (const YAML::Exception& error) {
      throw std::invalid_argument(file.string() + ": " + error.what());
    }
  }

  /// The values of `key`, which is then known; nothing when the file does not name it.
  template <typename T>
  std::vector<T> take(const std::string& key) {
    const auto found = lists_.find(key);
    if (found == lists_.end()) return {};
    std::vector<T> values;
    for (const std::string& text : found->second.values) {
      try {
        values.push_back(YAML::Node(text).as<T>());
      } catch (const YAML::Exception&) {
        fail(found->second.line, "'" + text + "' is no value of '" + key + "'");
      }
      if (std::count(values.begin(), values.end(), values.back()) > 1)
        fail(found->second.line, "'" + key + "' names " + text + " twice");
    }
    lists_.erase(found);
    return values;
  }

  void require_all_taken() const {
    if (!lists_.empty()) fail(lists_.begin()->second.line, "unknown key '" + lists_.begin()->first + "'");
  }
  [[noreturn]] void fail(int line, const std::string& text) const {
    throw std::invalid_argument(file_.string() + ":" + std::to_string(line + 1) + ": " + text);
  }

 private:
  const std::filesystem::path file_;
  std::map<std::string, GridList> lists_;
};

template <typename T>
void set_field(AblationVariant& variant, const char* name, const T& value) {
  visit_variant(variant, [&](const char* field, auto& target) {
    if constexpr (std::is_same_v<std::remove_reference_t<decltype(target)>, T>)
      if (std::string_view(field) == name) target = value;
  });
}

}  // namespace

std::string key_of(const AblationVariant& variant) {
  std::map<std::string, std::string> full;
  const AblationVariant whole;
  visit_variant(whole, [&full](const char* name, const auto& value) { full[name] = text_of(value); });
  std::string key;
  visit_variant(variant, [&](const char* name, const auto& value) {
    if (text_of(value) != full.at(name))
      key += (key.empty() ? "" : ",") + std::string(name) + "=" + text_of(value);
  });
  return key.empty() ? "full" : key;
}

std::vector<AblationCell> read_grid(const std::filesystem::path& path) {
  GridFile file(path);
  std::vector<AblationVariant> variants{{}};
  const AblationVariant names;
  visit_variant(names, [&](const char* name, const auto& example) {
    using T = std::remove_cvref_t<decltype(example)>;
    const std::vector<T> values = file.take<T>(name);
    if (values.empty()) return;
    if (values.size() * variants.size() > most_cells)
      throw std::invalid_argument(path.string() + ": more than " + std::to_string(most_cells) + " cells");
    std::vector<AblationVariant> product;
    for (const AblationVariant& variant : variants) {
      for (const T& value : values) {
        product.push_back(variant);
        set_field(product.back(), name, value);
      }
    }
    variants = std::move(product);
  });
  std::vector<int> steps = file.take<int>("flow_steps");
  if (steps.empty()) steps = {AblationCell{}.flow_steps};
  const auto [fewest, most] = std::ranges::minmax(steps);
  if (fewest < 1 || most > most_flow_steps)
    throw std::invalid_argument(path.string() + ": flow_steps must lie in 1 to " +
                                std::to_string(most_flow_steps));
  file.require_all_taken();
  std::vector<AblationCell> cells;
  for (const AblationVariant& variant : variants)
    for (const int count : steps) cells.push_back({variant, count});
  return cells;
}

}  // namespace flowscope
