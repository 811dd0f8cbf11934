// Farthest point sampling: each point chosen is the one farthest from those chosen before (Eldar et al. 1997,
// doi:10.1109/83.623193). Exact: the same choice as the plain algorithm, number for number; buckets of points
// too near to a choice to be touched by the next one are left alone.
#pragma once

#include <vector>

#include "policy/point_buckets.h"

namespace flowscope {

/// Indices of min(count, n) points in the order of their choice, beginning with `first`; of equally far ones
/// the one with the lowest index. The same on every machine. Any thread. Throws std::invalid_argument for no
/// points, an unknown `first` and numbers that are not finite.
std::vector<int> farthest_points(const FarthestInput& input, int count, int first = 0,
                                 const PointKernels* kernels = nullptr);

/// Every index once: the first `even` in farthest-point order beginning with 0, the others where they were,
/// save that each chosen point exchanged its place with the one that stood in front; of equally far ones the
/// one that stands first at that moment.
std::vector<int> farthest_order(const FarthestInput& input, int even);

}  // namespace flowscope
