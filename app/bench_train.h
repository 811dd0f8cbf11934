// How fast the policy learns from recorded demonstrations.
#pragma once

#include <filesystem>
#include <vector>

#include "policy/bench.h"

namespace flowscope {

/// Records two demonstrations of push_buttons and measures the learning of the preset on them
/// (policy/bench_learning.h).
std::vector<BenchResult> bench_train(const std::filesystem::path& assets, const std::string& preset = "desk",
                                     int steps = 12);

}  // namespace flowscope
