// The gripper of a robot's description in the scene that it is checked against.
#pragma once

#include <string>
#include <vector>

#include "recorder/robot.h"
#include "recorder/robot_ties.h"
#include "render/mujoco_owners.h"

namespace flowscope {

/// What the checks of a gripper (gripper_check.h) know of it; fingers are counted as in the description.
struct GripperScene {
  /// Arguments as of check_gripper.
  GripperScene(const mjModel_* model, const RobotDescription& robot, const std::vector<int>& arm, int hand,
               bool to_come);

  /// Throws BadScript at a finger's line: `key` is ".joint", ".open" and so on.
  [[noreturn]] void fail(std::size_t finger, const char* key, const std::string& message) const;

  /// The arm at home, the fingers where the description has them at this openness, and what follows those by
  /// equalities.
  void pose(double openness);
  /// Whether an actuator moves a joint, in the present pose.
  bool acts_on(int actuator, int joint) const;
  /// "; grip does", or nothing.
  std::string driver_of(int joint) const;

  /// Whether a finger's own actuator acts on a joint.
  bool pulls(std::size_t finger, int joint) const { return pulled[finger][static_cast<std::size_t>(joint)]; }
  /// Whether any finger's does.
  bool is_driven(int joint) const;
  /// Whether a finger's actuator is to come with the description.
  bool is_added(std::size_t finger) const { return to_come && robot.fingers[finger].stiffness > 0; }
  double way(std::size_t finger) const;        ///< from open to closed, m or rad
  const char* unit(std::size_t finger) const;  ///< " m" or " rad"
  std::string joint_name(int joint) const;
  bool is_below(int body, int ancestor) const;
  Pose world_from_tool() const;

  const mjModel_* model;
  const RobotDescription& robot;
  const std::vector<int>& arm;
  int hand;
  bool to_come;
  JointTies ties;
  DataPtr data;
  std::vector<int> joints, actuators;     ///< of the fingers; actuator -1: none, or to come
  std::vector<std::vector<bool>> pulled;  ///< of each finger's actuator: the joints that it acts on
};

}  // namespace flowscope
