// The robot inside a compiled scene: where its joints live, how it is driven, and what it holds.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "recorder/demo.h"

struct mjModel_;
struct mjData_;

namespace flowscope {

inline constexpr std::array<double, 7> home_joints{0, 0.1745, 0, -0.8727, 0, 1.2217, 0.7854};  ///< rad

/// Names are those of assets/robots/panda.xml. Holds indices only; the caller owns model and data.
class WorldRobot {
 public:
  /// Throws std::runtime_error when a part is missing.
  explicit WorldRobot(const mjModel_* model);

  /// Home posture, fingers open, at rest.
  void go_home(mjData_* data) const;
  std::array<double, 7> joint_targets(const mjData_* data) const;
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
  std::array<int, 7> qpos_{}, dof_{}, actuator_{};
  std::array<int, 2> finger_qpos_{}, finger_dof_{}, finger_actuator_{};
  std::array<double, 7> damping_{};
  std::vector<Grasp> grasps_;
  int tool_site_ = 0, attach_site_ = 0, hand_ = 0;
};

}  // namespace flowscope
