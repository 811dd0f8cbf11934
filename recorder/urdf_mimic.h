// URDF's <mimic>: joints that follow others. MuJoCo passes over it.
#pragma once

#include <string>
#include <vector>

#include "recorder/scene_source.h"

struct mjModel_;

namespace flowscope {

/// follower = offset + multiplier * leader, rad or m.
struct JointCoupling {
  std::string follower, leader;
  double multiplier = 1, offset = 0;
};

/// In the order of the text. Throws SceneError "<file>:<line>: …" for numbers
/// that are none, for a leader that the URDF has not, and for joints that follow each other in a circle.
std::vector<JointCoupling> read_mimics(const SceneSource& urdf);

/// The MJCF with an equality constraint for each. Couplings of joints that `model`, which it is of, lacks
/// (those of fixed joints) are left out.
std::string with_couplings(const std::string& mjcf, const mjModel_* model,
                           const std::vector<JointCoupling>& couplings);

/// Puts the followers to where they belong.
void follow(const std::vector<JointCoupling>& couplings, const mjModel_* model, std::vector<double>& qpos);

}  // namespace flowscope
