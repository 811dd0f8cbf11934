// A task.yaml as a tree of plain values that remember their place, with placeholders that an episode fills
// in.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "recorder/script.h"

namespace flowscope {

/// What `{name}` stands for in one variation and episode.
using Variables = std::map<std::string, std::string>;

struct TaskNode {
  enum class Kind { scalar, list, map };
  Kind kind = Kind::scalar;
  std::string text;               ///< scalars
  std::vector<std::string> keys;  ///< maps: keys[i] names items[i]
  std::vector<TaskNode> items;    ///< lists and maps
  int line = 1, column = 1;       ///< in the file, from 1

  bool is_map() const { return kind == Kind::map; }
  bool is_list() const { return kind == Kind::list; }
  bool is_scalar() const { return kind == Kind::scalar; }
  const TaskNode* find(const std::string& key) const;
};

/// Reads typed values out of the tree; every complaint is a BadScript that starts with
/// "<file>:<line>:<column>: ".
class TaskReader {
 public:
  explicit TaskReader(std::string file) : file_(std::move(file)) {}
  const std::string& file() const { return file_; }

  /// Throws BadScript for text that is not YAML, has aliases or is nested beyond reason.
  TaskNode parse(const std::string& text) const;

  [[noreturn]] void fail(const TaskNode& node, const std::string& message) const;
  void check_keys(const TaskNode& node, const std::string& what,
                  const std::vector<std::string>& allowed) const;
  const TaskNode& require(const TaskNode& map, const std::string& key) const;
  const std::vector<TaskNode>& list(const TaskNode& node, const std::string& what) const;
  const std::string& text(const TaskNode& node, const std::string& what) const;
  double number(const TaskNode& node, const std::string& what) const;
  int integer(const TaskNode& node, const std::string& what, int lower, int upper) const;
  std::vector<double> numbers(const TaskNode& node, const std::string& what, std::size_t count) const;

  /// Copy with every `{name}` replaced (innermost first, so `{color_{i}}` works) and every list item
  /// `{repeat: N, from: 1, each: […]}` unrolled with `{i}` counting up to N.
  TaskNode fill(const TaskNode& node, const Variables& variables) const;

 private:
  std::string filled(const TaskNode& node, const std::string& text, const Variables& variables) const;
  void fill_item(const TaskNode& item, const Variables& variables, std::vector<TaskNode>& out) const;
  std::string file_;
};

/// One line of YAML in flow style.
std::string to_yaml(const TaskNode& node);

}  // namespace flowscope
