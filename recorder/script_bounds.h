// What a script may cost to read, judged in one cheap pass before the YAML reader sees it.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace flowscope {

struct BoundBroken {
  int line = 0, column = 0;  ///< counted from zero
  std::string message;
};

/// The first place that goes beyond `most_steps` items of a list, 60 000 keys and values, 16 open brackets,
/// or 1024 characters in one word or quoted text (what YAML allows a key). Says nothing about whether it is
/// YAML: brackets count wherever they stand, so what it lets through may still be too much for the grammar,
/// but not for the machine.
std::optional<BoundBroken> broken_bound(std::string_view text, std::size_t most_steps);

}  // namespace flowscope
