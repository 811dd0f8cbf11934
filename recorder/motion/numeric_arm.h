// Kinematics of any arm of hinges, from nothing but the axes of its joints.
//
// Forwards: the product of exponentials (Brockett 1984). Backwards: Levenberg-Marquardt steps on the pose
// error, damped in proportion to it as Sugihara, "Solvability-Unconcerned Inverse Kinematics by the
// Levenberg-Marquardt Method", IEEE T-RO 2011, does, from many starting postures.
#pragma once

#include <optional>
#include <vector>

#include "recorder/motion/kinematics.h"

namespace flowscope {

/// Immutable; may be shared between threads.
class NumericArm {
 public:
  /// With all joints at 0, in the world.
  struct Hinge {
    Eigen::Vector3d axis;    ///< unit
    Eigen::Vector3d anchor;  ///< a point on it, metres
  };
  /// `home`: a posture to start from besides random ones. One hinge per joint of `limits`.
  NumericArm(std::vector<Hinge> hinges, const Pose& world_from_tool_at_zero, const JointLimits& limits,
             const JointVector& home);

  Pose world_from_tool(const JointVector& q) const;
  const JointLimits& limits() const { return limits_; }
  /// sqrt(det(J J^T)), m^3; 0 for an arm of fewer than six joints.
  double manipulability(const JointVector& q) const;

  /// The solution that the steps from `start` lead to, with joints to spare as near to `posture` as the pose
  /// allows; none when they do not arrive (1e-8 m and rad) within the limits.
  std::optional<JointVector> solve_from(const Pose& world_from_tool, const JointVector& start,
                                        const JointVector& posture) const;
  /// Clearly different solutions (0.05 rad), the nearest to `near` first. Always the same for the same
  /// arguments.
  std::vector<JointVector> solve_all(const Pose& world_from_tool, const JointVector& near) const;

 private:
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  using Jacobian = Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, max_joints>;
  using Step = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, max_joints, 1>;

  /// Tool pose and, where wanted, how it changes: rows 0 to 2 m/rad, rows 3 to 5 rad/rad, world axes.
  Pose forward(const JointVector& q, Jacobian* jacobian) const;
  Step damped_step(const Jacobian& jacobian, const Vector6& error, const JointVector& q) const;
  /// Part of the way to `posture` that does not move the tool.
  Step idle_step(const Jacobian& jacobian, const JointVector& q, const JointVector& posture) const;
  void take(const Step& step, JointVector& q) const;
  bool converge(const Pose& wanted, JointVector& q, int steps) const;
  bool into_limits(JointVector& q, const JointVector& near) const;
  bool turns_freely(std::size_t joint) const;

  std::vector<Hinge> hinges_;
  Pose world_from_tool_at_zero_;
  JointLimits limits_;
  JointVector home_;
};

}  // namespace flowscope
