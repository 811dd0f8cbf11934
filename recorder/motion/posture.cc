#include "recorder/motion/posture.h"

#include <algorithm>

namespace flowscope {
namespace {

constexpr double kRoom_rad = 0.3;      ///< from a joint limit: enough
constexpr double kLackOfRoom = 5;      ///< how much farther, per rad of it lacking, another posture may be
constexpr double kManipulable = 0.03;  ///< m^3: enough; a Panda in the middle of its workspace has 0.1
constexpr double kLackOfManipulability = 25;  ///< rad per m^3

}  // namespace

double posture_cost(const JointVector& q, const JointVector& near, const JointLimits& limits,
                    double manipulability) {
  double room = kRoom_rad;
  for (std::size_t i = 0; i < limits.joints; ++i) {
    room = std::min({room, q[i] - limits.lower[i], limits.upper[i] - q[i]});
  }
  return joint_distance(q, near) + kLackOfRoom * (kRoom_rad - room) +
         kLackOfManipulability * std::max(0.0, kManipulable - manipulability);
}

}  // namespace flowscope
