// Hulls put together again after cuts that were not all needed.
#pragma once

#include "recorder/mesh/mesh.h"

namespace flowscope {

/// Each entry holds the corners of a convex part, and so does each of the result. Joins the pair that adds
/// least volume, while that is at most `little` for parts that touch, or there are more than `most` of them.
std::vector<std::vector<Eigen::Vector3d>> joined_hulls(const std::vector<std::vector<Eigen::Vector3d>>& parts,
                                                       std::size_t most, double little);

}  // namespace flowscope
