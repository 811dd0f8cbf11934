// A robot's description held against the scene in which it is to move: nothing in it is taken on trust.
#pragma once

#include "recorder/motion/kinematics.h"
#include "recorder/robot.h"

struct mjModel_;

namespace flowscope {

/// Whether what a description brings along (sites, actuators) is in the scene already.
enum class Additions { to_come, in_place };

/// Names exist; the joints are hinges in one chain below each other, and nothing but them moves the tool;
/// actuator i is a position servo of joint i and lets go home; nothing else holds the arm; home, open and
/// closed lie inside the joints' ranges; each finger is driven, or tied by an equality to one that is; and
/// the inputs that open and close it do so. Throws BadScript with the description's file, line and column,
/// the names of both sides and what to do.
void check_robot(const mjModel_* model, const RobotDescription& robot, Additions additions);

/// The kinematics of a robot that was checked, with the description's place in what is thrown (BadScript).
Kinematics kinematics_of(const mjModel_* model, const RobotDescription& robot);

}  // namespace flowscope
