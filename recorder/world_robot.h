// The robot inside a compiled scene: where its joints live, how it is driven, and what it holds.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "recorder/demo.h"
#include "recorder/robot.h"
#include "recorder/robot_ties.h"

struct mjModel_;
struct mjData_;

namespace flowscope {

/// The caller owns model and data; the model outlives this. Without a robot (an empty description) nothing is
/// driven and the tool is the world's origin. Arrays of joints: those that the arm has not stay 0.
class WorldRobot {
 public:
  /// Throws std::runtime_error when a part is missing.
  WorldRobot(const mjModel_* model, const RobotDescription& robot);

  /// Home posture, fingers open, at rest.
  void go_home(mjData_* data) const;
  /// What joints (rad) and fingers (0 closed, 1 open) were last told.
  std::array<double, 7> joint_targets(const mjData_* data) const;
  double openness_target(const mjData_* data) const;
  /// Between both halves of a physics step: actuator targets, gravity and damping compensation.
  void drive(mjData_* data, const std::array<double, 7>& target, const std::array<double, 7>& target_speed,
             double openness, bool holding) const;
  std::array<double, 7> positions(const mjData_* data) const;  ///< rad
  std::array<double, 7> speeds(const mjData_* data) const;     ///< rad/s
  double openness(const mjData_* data) const;                  ///< 0 closed, 1 open
  Pose world_from_tool(const mjData_* data) const;

  /// Ties every graspable body that reaches into the attach box to the hand, as it lies; true when there was
  /// one.
  bool grasp(mjModel_* model, mjData_* data) const;
  void release(mjModel_* model) const;
  std::vector<std::string> grasped(const mjModel_* model) const;

 private:
  struct Grasp {
    int equality = 0, body = 0;
  };
  struct Joint {
    int qpos = 0, dof = 0, actuator = 0;
    double damping = 0, home = 0;
    double servo_stiffness = 0, servo_damping = 0;  ///< of its actuator
    double lowest_force = 0, highest_force = 0;
    double servo_force(double target, double q, double speed) const;
  };
  struct Finger {
    int qpos = 0, dof = 0, actuator = -1;  ///< actuator -1: an equality moves it
    double open = 0, closed = 0;           ///< of the joint
    bool own_units = false;                ///< the actuator's inputs are no values of the joint
    double input_open = 0, input_closed = 0;
    bool slow = false;  ///< longer on its way than a gripper's move takes
    double input(double openness) const { return input_closed + openness * (input_open - input_closed); }
    /// Of a joint's value.
    double input_at(double q) const { return own_units ? input((q - closed) / (open - closed)) : q; }
    /// That which opens more of two inputs.
    double wider(double a, double b) const { return (a < b) == (input_closed < input_open) ? b : a; }
    /// What presses on a thing at which it stands.
    double pressing(double q, double squeeze) const {
      return wider(input_closed, input_at(q - (open > closed ? squeeze : -squeeze)));
    }
    /// Of a slow one, in every step: it closes until it touches something, then presses.
    double holding_input(double q, bool touching, double squeeze) const;
  };
  /// Whether a finger touches anything that can be taken.
  bool touches(const mjData_* data) const;

  std::vector<Joint> joints_;
  std::vector<Finger> fingers_;
  std::vector<Grasp> grasps_;
  const mjModel_* model_;
  std::optional<JointTies> ties_;  ///< what follows arm and fingers
  std::vector<bool> driven_;       ///< joints that the description names
  std::vector<bool> of_fingers_;   ///< bodies that move with fingers
  double squeeze_ = 0;
  int tool_site_ = -1, attach_site_ = -1, hand_ = -1;
};

}  // namespace flowscope
