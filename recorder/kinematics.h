// Forward and inverse kinematics of the Panda arm, closed form.
//
// Inverse: the seventh joint is the free parameter. With q7 given the wrist frame follows from the tool pose,
// the shoulder, elbow and wrist centre form a triangle of known sides, and the rest is plane geometry: at
// most eight solutions. The idea of q7 as parameter is that of He & Liu, "Analytical Inverse Kinematics for
// Franka Emika Panda", ICCMA 2021, DOI 10.1109/ICCMA54375.2021.9646185.
#pragma once

#include <array>
#include <vector>

#include "render/pose.h"

struct mjModel_;

namespace flowscope {

using JointVector = std::array<double, 7>;  ///< rad, from the base to the flange

struct JointLimits {
  JointVector lower{}, upper{};  ///< rad
  bool contain(const JointVector& q) const;
};

/// Largest difference of any joint, rad.
double joint_distance(const JointVector& a, const JointVector& b);

/// Where the arm's joints live in a model: the seven hinges on the way from the site `tool` down to the
/// world.
struct ArmIndices {
  std::array<int, 7> joint{}, qpos{}, dof{};
  int tool_site = -1;
};
/// Throws std::runtime_error when the model has no site `tool` that hangs on exactly seven hinges.
ArmIndices find_arm(const mjModel_* model);

/// Immutable; may be shared between threads.
class Kinematics {
 public:
  Kinematics(const Pose& world_from_base, const Pose& flange_from_tool, const JointLimits& limits);
  /// Takes base pose, tool offset and joint limits from the model and checks at several postures that the arm
  /// in it is a Panda; throws std::runtime_error when its tool is anywhere else than computed (1e-9 m, 1e-9
  /// rad).
  static Kinematics from_model(const mjModel_* model);

  Pose world_from_tool(const JointVector& q) const;
  const JointLimits& limits() const { return limits_; }

  /// All solutions with this q7 that respect the joint limits; at most eight, in a fixed order.
  std::vector<JointVector> solve(const Pose& world_from_tool, double q7) const;
  /// Solutions over a sweep of `samples` values of q7, ordered by distance to `near` (the nearest joint
  /// posture first).
  std::vector<JointVector> solve_all(const Pose& world_from_tool, const JointVector& near,
                                     int samples = 96) const;

 private:
  Pose world_from_base_, flange_from_tool_;
  JointLimits limits_;
};

}  // namespace flowscope
