// The choice of points, against PCL's in the same run.
#pragma once

#include <vector>

#include "policy/bench.h"

namespace flowscope {

/// policy/bench_points.h with pcl::FarthestPointSampling as the other.
std::vector<BenchResult> bench_points_against_pcl();

}  // namespace flowscope
