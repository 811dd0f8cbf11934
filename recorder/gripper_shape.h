// The hand of a scene's own robot as the shape of its ghosts.
#pragma once

#include <memory>

#include "recorder/robot.h"
#include "render/gripper_shape.h"

struct mjModel_;

namespace flowscope {

/// What a picture shows (geom groups 0 to 2) of the hand and all below it, the fingers from closed to open;
/// of a hand of more than 100 pieces the largest. Null when the model lacks the robot's hand, tool or a
/// finger, or the hand has nothing to show.
std::shared_ptr<const GripperShape> gripper_shape(const mjModel_* model, const RobotDescription& robot);

}  // namespace flowscope
