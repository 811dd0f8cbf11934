// How fast the policy learns, counted in samples.
#pragma once

#include <filesystem>
#include <vector>

#include "policy/bench.h"

namespace flowscope {

/// Records two demonstrations of push_buttons and trains the preset on them for `steps` optimiser steps.
std::vector<BenchResult> bench_train(const std::filesystem::path& assets, const std::string& preset = "desk",
                                     int steps = 12);

}  // namespace flowscope
