// One measured number, as `flowscope bench` prints it.
#pragma once

#include <optional>
#include <string>

namespace flowscope {

struct BenchResult {
  std::string name;
  double value = 0;
  std::string unit;
  std::optional<double> ratio;         ///< how many times faster than `against`
  std::optional<std::string> against;  ///< what it was compared with, in the same run
};

}  // namespace flowscope
