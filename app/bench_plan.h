// Planning on random tabletop problems: how often, how fast, and whether what comes out is free.
#pragma once

#include <filesystem>
#include <vector>

#include "policy/bench.h"

namespace flowscope {

/// Pairs of random tool poses among the objects of several tasks, each reachable and free: from one posture
/// to the other pose as a scripted move does it, until its timed targets are known. These are checked again
/// at four times finer resolution than the planner's last check.
std::vector<BenchResult> bench_plan(const std::filesystem::path& assets, int pairs = 1000);

}  // namespace flowscope
