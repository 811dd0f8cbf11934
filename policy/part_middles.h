// The middle and the yaw of small like-coloured parts, read off their outline.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "policy/surroundings.h"

namespace flowscope {

/// Points of parts that reach no further than this from their middle share one middle; metres, horizontally.
inline constexpr float part_reach_m = 0.045f;

/// Gives every point of a small part the part's surroundings; all others keep those in `around`. `position`
/// in metres (world), `part` as of find_parts (-1: none). A camera shows more of the sides that face it, so a
/// mean of the visible points lies up to 10 mm beside the axis of a peg; the convex outline seen from above
/// is complete as soon as the top is seen. middle: its centre of area, half-way up; square and bar: moments
/// of its area.
void center_small_parts(const std::vector<Eigen::Vector3f>& position, const std::vector<int>& part,
                        std::vector<Surroundings>& around);

}  // namespace flowscope
