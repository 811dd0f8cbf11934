#include "recorder/task_tree.h"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <sstream>

namespace flowscope {
namespace {

constexpr std::size_t kMaxBytes = 256 * 1024, kMaxDepth = 32;
constexpr int kMaxRepeat = 1000;

/// Builds the tree from the parser's events, which carry the marks of keys and values alike.
class TreeBuilder : public YAML::EventHandler {
 public:
  explicit TreeBuilder(const TaskReader& reader) : reader_(reader) {}
  TaskNode take() { return std::move(root_); }

  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t) override { scalar(mark, ""); }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override {
    reader_.fail(at(mark), "aliases are not part of a task file");
  }
  void OnScalar(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                const std::string& value) override {
    scalar(mark, value);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {
    open(mark, TaskNode::Kind::list);
  }
  void OnSequenceEnd() override { close(); }
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {
    open(mark, TaskNode::Kind::map);
  }
  void OnMapEnd() override { close(); }

 private:
  struct Level {
    TaskNode node;
    bool has_key = false;
  };
  static TaskNode at(const YAML::Mark& mark) {
    TaskNode node;
    node.line = std::max(mark.line, 0) + 1;
    node.column = std::max(mark.column, 0) + 1;
    return node;
  }
  void scalar(const YAML::Mark& mark, const std::string& value) {
    TaskNode node = at(mark);
    node.text = value;
    if (!levels_.empty() && levels_.back().node.is_map() && !levels_.back().has_key) {
      Level& level = levels_.back();
      if (level.node.find(value)) reader_.fail(node, "'" + value + "' is given twice");
      level.node.keys.push_back(value);
      level.has_key = true;
      return;
    }
    add(std::move(node));
  }
  void open(const YAML::Mark& mark, TaskNode::Kind kind) {
    TaskNode node = at(mark);
    if (levels_.size() >= kMaxDepth) reader_.fail(node, "nested too deeply");
    if (!levels_.empty() && levels_.back().node.is_map() && !levels_.back().has_key) {
      reader_.fail(node, "a key must be a word");
    }
    node.kind = kind;
    levels_.push_back({std::move(node)});
  }
  void close() {
    TaskNode node = std::move(levels_.back().node);
    levels_.pop_back();
    add(std::move(node));
  }
  void add(TaskNode node) {
    if (levels_.empty()) {
      root_ = std::move(node);
      return;
    }
    levels_.back().node.items.push_back(std::move(node));
    levels_.back().has_key = false;
  }
  const TaskReader& reader_;
  std::vector<Level> levels_;
  TaskNode root_;
};

std::string quoted(const std::string& text) {
  double number = 0;
  const YAML::Node node(text);
  const bool plain = !text.empty() && text.find_first_not_of(
                                          "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                          "0123456789_.+-") == std::string::npos;
  if (plain &&
      (std::isalpha(static_cast<unsigned char>(text[0])) || YAML::convert<double>::decode(node, number))) {
    return text;
  }
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c == '\n' ? ' ' : c;
  }
  return out + '"';
}

}  // namespace

const TaskNode* TaskNode::find(const std::string& key) const {
  const auto found = std::find(keys.begin(), keys.end(), key);
  return found == keys.end() ? nullptr : &items[static_cast<std::size_t>(found - keys.begin())];
}

TaskNode TaskReader::parse(const std::string& content) const {
  if (content.size() > kMaxBytes) fail(TaskNode{}, "larger than 256 KiB");
  try {
    std::istringstream stream(content);
    YAML::Parser parser(stream);
    TreeBuilder builder(*this);
    if (!parser.HandleNextDocument(builder)) fail(TaskNode{}, "is empty");
    return builder.take();
  } catch (const YAML::Exception& error) {
    TaskNode node;
    node.line = std::max(error.mark.line, 0) + 1;
    node.column = std::max(error.mark.column, 0) + 1;
    fail(node, "is not YAML: " + error.msg);
  }
}

void TaskReader::fail(const TaskNode& node, const std::string& message) const {
  std::ostringstream out;
  out << file_ << ':' << node.line << ':' << node.column << ": " << message;
  throw BadScript(out.str());
}

void TaskReader::check_keys(const TaskNode& node, const std::string& what,
                            const std::vector<std::string>& allowed) const {
  if (!node.is_map()) fail(node, "'" + what + "' must be a map of keys and values");
  for (std::size_t i = 0; i < node.keys.size(); ++i) {
    if (std::find(allowed.begin(), allowed.end(), node.keys[i]) != allowed.end()) continue;
    std::string known;
    for (const auto& name : allowed) known += (known.empty() ? "" : ", ") + name;
    fail(node.items[i], "'" + what + "' has no key '" + node.keys[i] + "' (known: " + known + ")");
  }
}

const TaskNode& TaskReader::require(const TaskNode& map, const std::string& key) const {
  if (!map.is_map()) fail(map, "a map with '" + key + "' belongs here");
  const TaskNode* found = map.find(key);
  if (!found) fail(map, "'" + key + "' is missing");
  return *found;
}

const std::vector<TaskNode>& TaskReader::list(const TaskNode& node, const std::string& what) const {
  if (!node.is_list()) fail(node, "'" + what + "' must be a list");
  return node.items;
}

const std::string& TaskReader::text(const TaskNode& node, const std::string& what) const {
  if (!node.is_scalar() || node.text.empty()) fail(node, "'" + what + "' must be a word");
  return node.text;
}

double TaskReader::number(const TaskNode& node, const std::string& what) const {
  double value = 0;
  if (!node.is_scalar() || !YAML::convert<double>::decode(YAML::Node(node.text), value) ||
      !std::isfinite(value)) {
    fail(node, "'" + what + "' needs a number here");
  }
  return value;
}

int TaskReader::integer(const TaskNode& node, const std::string& what, int lower, int upper) const {
  const double value = number(node, what);
  if (value != std::floor(value) || value < lower || value > upper) {
    fail(node, "'" + what + "' must be a whole number from " + std::to_string(lower) + " to " +
                   std::to_string(upper));
  }
  return static_cast<int>(value);
}

std::vector<double> TaskReader::numbers(const TaskNode& node, const std::string& what,
                                        std::size_t count) const {
  if (!node.is_list() || node.items.size() != count) {
    fail(node, "'" + what + "' must be a list of " + std::to_string(count) + " numbers");
  }
  std::vector<double> values;
  for (const auto& item : node.items) values.push_back(number(item, what));
  return values;
}

std::string TaskReader::filled(const TaskNode& node, const std::string& content,
                               const Variables& variables) const {
  std::string result = content;
  for (auto end = result.find('}'); end != std::string::npos; end = result.find('}')) {
    const auto begin = result.rfind('{', end);
    if (begin == std::string::npos) fail(node, "'}' without '{'");
    const std::string name = result.substr(begin + 1, end - begin - 1);
    const auto found = variables.find(name);
    if (found == variables.end()) {
      std::string known;
      for (const auto& [key, value] : variables) known += (known.empty() ? "" : ", ") + key;
      fail(node, "nothing is called {" + name + "} here (known: " + known + ")");
    }
    result.replace(begin, end - begin + 1, found->second);
  }
  return result;
}

void TaskReader::fill_item(const TaskNode& item, const Variables& variables,
                           std::vector<TaskNode>& out) const {
  if (!item.find("repeat")) {
    out.push_back(fill(item, variables));
    return;
  }
  check_keys(item, "repeat", {"repeat", "from", "each"});
  const int last = integer(fill(*item.find("repeat"), variables), "repeat", 0, kMaxRepeat);
  const TaskNode* from = item.find("from");
  const int first = from ? integer(fill(*from, variables), "from", 0, kMaxRepeat) : 1;
  for (int i = first; i <= last; ++i) {
    Variables counted = variables;
    counted["i"] = std::to_string(i);
    for (const auto& each : list(require(item, "each"), "each")) fill_item(each, counted, out);
  }
}

TaskNode TaskReader::fill(const TaskNode& node, const Variables& variables) const {
  TaskNode result = node;
  result.items.clear();
  if (node.is_scalar()) result.text = filled(node, node.text, variables);
  for (const auto& item : node.items) {
    if (node.is_list()) {
      fill_item(item, variables, result.items);
    } else {
      result.items.push_back(fill(item, variables));
    }
  }
  return result;
}

std::string to_yaml(const TaskNode& node) {
  if (node.is_scalar()) return quoted(node.text);
  std::string out(1, node.is_map() ? '{' : '[');
  for (std::size_t i = 0; i < node.items.size(); ++i) {
    if (i > 0) out += ", ";
    if (node.is_map()) out += node.keys[i] + ": ";
    out += to_yaml(node.items[i]);
  }
  return out + (node.is_map() ? '}' : ']');
}

}  // namespace flowscope
