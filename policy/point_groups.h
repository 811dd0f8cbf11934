// Groups of neighbouring points and two orders in which to read them (PointMamba, arXiv:2402.10739). No torch
// here.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <span>
#include <vector>

namespace flowscope {

struct PointGroups {
  std::vector<int> center;     ///< [groups] points in farthest-point order
  std::vector<int> neighbour;  ///< [groups * size] points nearest to each centre, nearest first: itself
  std::vector<int> hilbert;    ///< [groups] the groups as they lie along the Hilbert curve
  std::vector<int> transposed_hilbert;  ///< [groups]
  float reach_m = 0;                    ///< mean distance from a centre to the farthest of its group
};

/// Runs its second argument over parts of 0 … count, perhaps on several threads at once.
using OverParts = std::function<void(int count, const std::function<void(int first, int last)>&)>;
void on_this_thread(int count, const std::function<void(int first, int last)>& part);

/// Any thread. The groups do not depend on the order of the points, unless distances are equal to the bit:
/// the first centre is the point of the lowest x, then y, then z. Throws std::invalid_argument where there
/// are fewer points than `groups` or `size`, or a position is not finite.
PointGroups group_points(std::span<const Eigen::Vector3f> position, int groups, int size,
                         const OverParts& over_parts = on_this_thread);

}  // namespace flowscope
