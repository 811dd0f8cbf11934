// The gripper of a robot's description, held against its scene (robot_check.h).
#pragma once

#include <vector>

#include "recorder/robot.h"

struct mjModel_;

namespace flowscope {

/// `arm`: ids of the arm's joints, which were checked, as was the body `hand`. With `to_come`, actuators of
/// fingers that have a stiffness are not there yet. Throws BadScript.
void check_gripper(const mjModel_* model, const RobotDescription& robot, const std::vector<int>& arm,
                   int hand, bool to_come);

}  // namespace flowscope
