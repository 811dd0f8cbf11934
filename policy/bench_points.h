// How fast points are chosen and scenes prepared at the paper's size.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "policy/bench.h"

namespace flowscope {

struct PointBenchOptions {
  int points = 65536, chosen = 1024;
  int repeats = 7;  ///< the fastest of them counts
};

/// Somebody else's farthest point sampling.
struct OtherSampler {
  std::string name;
  std::function<std::vector<int>(const std::vector<Eigen::Vector3f>& position, int count)> choose;
};

/// On one thread, on a table with bumps that takes no files; about two seconds. With `other`: its time over
/// ours for the same points, and its coverage radius over ours.
std::vector<BenchResult> bench_points(const OtherSampler* other = nullptr,
                                      const PointBenchOptions& options = {});

}  // namespace flowscope
