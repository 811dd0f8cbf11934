// Convex hulls by Qhull.
#pragma once

#include "recorder/mesh/mesh.h"

namespace flowscope {

/// The hull as a closed mesh, outside out. Empty when the points lie in a plane (or are fewer than four).
TriangleMesh convex_hull(const std::vector<Eigen::Vector3d>& points);
/// 0 when the points lie in a plane.
double hull_volume(const std::vector<Eigen::Vector3d>& points);
/// The hull of at most `most` of the points: those that are farthest in evenly spread directions, with the
/// extremes along the axes among them.
TriangleMesh simple_hull(const std::vector<Eigen::Vector3d>& points, int most);

}  // namespace flowscope
