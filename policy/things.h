// Things on the table: groups of points that hang together. Training moves them about.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "policy/random.h"

namespace flowscope {

/// Group of each point, -1 for those with `skip` (the table). Points within 25 mm of each other share a
/// group.
std::vector<int> find_things(const std::vector<Eigen::Vector3f>& position, const std::vector<char>& skip);

/// A turn about the vertical through `pivot`, then a horizontal shift; metres, world.
struct ThingMove {
  Eigen::Vector3f pivot{0, 0, 0}, shift{0, 0, 0};
  float yaw_rad = 0;
};

/// One move per group. Things that stand on the plane, are smaller than 70 cm and not within reach of the
/// tool are shifted by up to `range_m` and turned by up to 25 degrees, so that none comes near another; all
/// else stays. The arm, which reaches over the table, is in nobody's way.
std::vector<ThingMove> shuffle_things(const std::vector<Eigen::Vector3f>& position,
                                      const std::vector<int>& thing, float plane_z,
                                      const Eigen::Vector3f& tool, float range_m, Random& random);

/// The group that a gripper at `place` is about: of those that stand on the plane the one horizontally
/// nearest, within 15 cm (it may wait in front of a handle or above a peg); -1: none.
int thing_at(const std::vector<Eigen::Vector3f>& position, const std::vector<int>& thing, float plane_z,
             const Eigen::Vector3f& place);

}  // namespace flowscope
