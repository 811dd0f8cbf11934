// Forward and inverse kinematics: of the Panda by panda_arm.h, of any other arm of hinges by numeric_arm.h.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "recorder/robot.h"
#include "render/pose.h"

struct mjModel_;

namespace flowscope {

/// rad, from the base to the flange; what an arm of fewer joints has not is 0.
using JointVector = std::array<double, max_joints>;

struct JointLimits {
  JointVector lower{}, upper{};     ///< rad
  std::size_t joints = max_joints;  ///< that the arm has
  bool contain(const JointVector& q) const;
};

/// Largest difference of any joint, rad.
double joint_distance(const JointVector& a, const JointVector& b);

/// Where the arm's joints live in a model.
struct ArmIndices {
  std::array<int, max_joints> joint{}, qpos{}, dof{};
  std::size_t joints = 0;  ///< entries in use
  int tool_site = -1, hand = -1;
};
/// Throws std::runtime_error when the model lacks a part of `robot`, or when one of its joints is no hinge.
ArmIndices find_arm(const mjModel_* model, const RobotDescription& robot);

class NumericArm;

/// Immutable; may be shared between threads.
class Kinematics {
 public:
  /// A Panda.
  Kinematics(const Pose& world_from_base, const Pose& flange_from_tool, const JointLimits& limits);
  /// Any other arm.
  explicit Kinematics(NumericArm arm);
  /// Takes the arm's geometry and joint limits from the model and checks at several postures that the tool is
  /// where the model has it; throws std::runtime_error when it is anywhere else (1e-9 m, 1e-9 rad): no Panda,
  /// or further joints that the description does not name.
  static Kinematics from_model(const mjModel_* model, const RobotDescription& robot);

  Pose world_from_tool(const JointVector& q) const;
  const JointLimits& limits() const { return limits_; }

  /// sqrt(det(J J^T)) of the tool's geometric Jacobian, m^3; 0 in a singularity.
  double manipulability(const JointVector& q) const;

  /// Panda: all solutions with this q7 that respect the joint limits; at most eight, in a fixed order. Other
  /// arms have no such parameter: none.
  std::vector<JointVector> solve(const Pose& world_from_tool, double q7) const;
  /// Solutions, the best posture (posture.h) first. A Panda's have `near`'s q7 or one of a sweep of `samples`
  /// values of it, and the best is refined between the samples; where a sweep finds none, finer ones follow.
  std::vector<JointVector> solve_all(const Pose& world_from_tool, const JointVector& near,
                                     int samples = 32) const;
  /// The next point of a path that stands at `near`: the nearest solution, with what the pose leaves open (a
  /// Panda's q7, the spare joints of other arms) as in `posture`.
  std::optional<JointVector> follow(const Pose& world_from_tool, const JointVector& near,
                                    const JointVector& posture) const;

 private:
  class Choice;
  Pose base_from_flange(const Pose& world_from_tool) const;

  Pose world_from_base_, flange_from_tool_;
  JointLimits limits_;
  std::shared_ptr<const NumericArm> numeric_;  ///< null: a Panda
};

}  // namespace flowscope
