// Inverse kinematics: how much it recovers, how exactly, how fast.
#pragma once

#include <filesystem>
#include <vector>

#include "policy/bench.h"

namespace flowscope {

/// recorder/motion/ik_recovery.h for 10^5 postures of a task's arm, and the median times of one call with all
/// branches and of a choice over all q7.
std::vector<BenchResult> bench_ik(const std::filesystem::path& assets);

}  // namespace flowscope
