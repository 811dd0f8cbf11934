// A robot as data: assets/robots/<name>.yaml beside <name>.xml.
//
//   joints: [joint1, joint2]               hinges from the base to the flange, 1 to 7
//   actuators: [actuator1, actuator2]      of the joints, in their order: position servos, whose input is the
//                                          joint's angle in rad
//   home: [0, 0.1745]                      rad
//   tool: tool                             site between the fingertips: +z leaves the hand, the fingers open
//                                          along y
//   attach: attach                         box site: what lies in it when the fingers close is taken
//   hand: hand                             body of both sites; what is taken is welded to it
//   inverse_kinematics: numeric            for any arm; panda: the closed form for that one
//   footprint: {center: [-0.3, 0], size: [0.28, 0.22]}           what the base covers of the table, m, world
//   limits: {velocity: 1.5, acceleration: 6, deceleration: 3}    of every joint, rad/s and rad/s^2
//   gripper:
//     fingers:                             slides (m) or hinges (rad); without an actuator: one that an
//                                          equality ties to the others
//       - {joint: finger_joint1, actuator: finger_actuator1, open: 0.04, closed: 0}
//     squeeze: 0.0005                      how far a finger presses into what it holds, m or rad
//
// A finger's actuator is a position servo, too. Where its inputs are not the joint's values (0 to 255, say,
// or a tendon that several fingers share), the description says which inputs open and close it; of two
// fingers that an equality ties, one is driven:
//
//       - {joint: driver, actuator: fingers, open: 0, closed: 0.8, command_open: 0, command_closed: 255}
//       - {joint: other_driver, open: 0, closed: 0.8}
//
// A scene that was not written for flowscope has neither sites nor actuators of this kind. For `--scene` the
// description may bring them along; other actuators of these joints are switched off:
//
//   stiffness: [4000, 4000]       in place of actuators, Nm/rad; of a finger: `stiffness: 500`, also N/m
//   tool: {body: flange, position: [0, 0, 0.1], rpy_deg: [0, 0, 0]}
//   attach: {body: flange, position: [0, 0, 0.09], rpy_deg: [0, 0, 0],
//            size: [0.02, 0.06, 0.04]}                           whole sides
//
// robot_check.h holds a description against the scene in which it is to move.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "render/pose.h"

namespace flowscope {

inline constexpr std::size_t max_joints = 7;  ///< what an arm may have; arrays keep the rest at 0

struct MotionLimits {
  double velocity = 1.5;      ///< rad/s, any joint
  double acceleration = 6.0;  ///< rad/s^2, any joint, along straight stretches of the path
  double deceleration = 3.0;  ///< gentler, so that a heavy arm does not swing past the end
};

struct FingerDescription {
  std::string joint, actuator;  ///< no actuator: it follows the others
  double open = 0, closed = 0;  ///< the joint's values, m or rad
  double stiffness = 0;         ///< above 0: of the actuator to be added, N/m or Nm/rad
  /// The actuator's inputs; not set: `open` and `closed` are its inputs as well. Both or none.
  std::optional<double> command_open = std::nullopt, command_closed = std::nullopt;
};

/// A site to be added to a scene.
struct SiteDescription {
  std::string body;
  Pose body_from_site;
  Eigen::Vector3d size{0, 0, 0};  ///< metres, whole sides
};

enum class InverseKinematics { panda, numeric };

/// Where its file says what, for messages; a description that was not read from a file has none.
struct RobotPlaces {
  std::string file;
  std::map<std::string, std::string> marks;  ///< "joints[1]", "fingers[0].open", "home": ":3:14"
  /// "arm.yaml:3:14: " for "home[1]", or for what it is a part of; the file's name where nothing is known.
  std::string of(std::string what) const;
};

/// A regular value. Default-constructed: no robot.
struct RobotDescription {
  std::string name;                            ///< of the file, without its ending
  std::vector<std::string> joints, actuators;  ///< as many of each
  std::array<double, max_joints> home{};       ///< rad
  std::vector<double> stiffness;               ///< Nm/rad: the actuators are to be added; empty: they exist
  std::string tool, attach, hand;
  std::optional<SiteDescription> tool_place, attach_place;  ///< set: the site is to be added
  InverseKinematics inverse_kinematics = InverseKinematics::panda;
  std::array<double, 2> footprint_center{}, footprint_size{};  ///< m, world; whole sides
  MotionLimits limits;
  std::vector<FingerDescription> fingers;
  double squeeze = 0;  ///< m or rad
  RobotPlaces places;
};

/// Throws BadScript that names file, line and column, or std::runtime_error when the file cannot be read.
RobotDescription read_robot(const std::filesystem::path& file);

}  // namespace flowscope
