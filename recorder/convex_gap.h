// How far two convex sets are apart, or how deep one is in the other.
// Gilbert, Johnson, Keerthi (1988) for the distance; van den Bergen's expanding polytope (2001) for the
// depth.
#pragma once

#include <functional>

#include "render/pose.h"

namespace flowscope {

/// Farthest point of a convex set along a direction (any length but zero), both in one frame.
using Support = std::function<Eigen::Vector3d(const Eigen::Vector3d& direction)>;

/// Metres: positive, the distance between the nearest points; negative, the shortest shift that would part
/// the two. Good to a micrometre or a millionth of the sets' size.
double convex_gap(const Support& first, const Support& second);

}  // namespace flowscope
