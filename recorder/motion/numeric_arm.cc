#include "recorder/motion/numeric_arm.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace flowscope {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kTurn = 2 * std::numbers::pi;
constexpr int kSteps = 50;       ///< from one starting posture
constexpr int kIdleRounds = 12;  ///< of a redundant arm, towards the wanted posture
constexpr double kIdle_rad = 1e-3;
constexpr int kStarts = 40;        ///< at random, besides the present posture and home
constexpr int kStartsInVain = 16;  ///< that bring nothing new: enough
constexpr double kApart_rad = 0.05;
constexpr double kLargestStep_rad = 0.7;
constexpr double kDone = 1e-11, kGoodEnough = 1e-8;  ///< m and rad

/// From `from` to `to` as a rotation vector, world axes.
Vector3d turn_between(const Matrix3d& from, const Eigen::Quaterniond& to) {
  Eigen::Quaterniond turn = to * Eigen::Quaterniond(from).conjugate();
  if (turn.w() < 0) turn.coeffs() = -turn.coeffs();
  const double sine = turn.vec().norm();
  return sine < 1e-15 ? Vector3d(2 * turn.vec())
                      : Vector3d(2 * std::atan2(sine, turn.w()) / sine * turn.vec());
}

}  // namespace

NumericArm::NumericArm(std::vector<Hinge> hinges, const Pose& world_from_tool_at_zero,
                       const JointLimits& limits, const JointVector& home)
    : hinges_(std::move(hinges)),
      world_from_tool_at_zero_(world_from_tool_at_zero),
      limits_(limits),
      home_(home) {}

Pose NumericArm::forward(const JointVector& q, Jacobian* jacobian) const {
  Matrix3d rotation = Matrix3d::Identity();
  Vector3d position = Vector3d::Zero();
  std::array<Vector3d, max_joints> axis, anchor;
  for (std::size_t i = 0; i < hinges_.size(); ++i) {
    axis[i] = rotation * hinges_[i].axis;
    anchor[i] = rotation * hinges_[i].anchor + position;
    rotation = rotation * Eigen::AngleAxisd(q[i], hinges_[i].axis).toRotationMatrix();
    position = anchor[i] - rotation * hinges_[i].anchor;
  }
  const Pose tool{rotation * world_from_tool_at_zero_.position + position,
                  (Eigen::Quaterniond(rotation) * world_from_tool_at_zero_.rotation).normalized()};
  if (jacobian) {
    jacobian->resize(6, static_cast<Eigen::Index>(hinges_.size()));
    for (std::size_t i = 0; i < hinges_.size(); ++i) {
      const auto column = static_cast<Eigen::Index>(i);
      jacobian->col(column).head<3>() = axis[i].cross(tool.position - anchor[i]);
      jacobian->col(column).tail<3>() = axis[i];
    }
  }
  return tool;
}

Pose NumericArm::world_from_tool(const JointVector& q) const { return forward(q, nullptr); }

NumericArm::Step NumericArm::damped_step(const Jacobian& jacobian, const Vector6& error,
                                         const JointVector& q) const {
  const double damping = 0.05 * error.squaredNorm() + 1e-12;
  const auto solve = [&](const Jacobian& columns) -> Step {
    const auto n = columns.cols();
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, max_joints, max_joints> normal =
        columns.transpose() * columns;
    normal += damping * decltype(normal)::Identity(n, n);
    return normal.ldlt().solve(columns.transpose() * error);
  };
  Step step = solve(jacobian);
  // A joint that stands at its limit and would go on stays: the others then do without it.
  Jacobian rest = jacobian;
  bool held = false;
  for (std::size_t i = 0; i < hinges_.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    if (turns_freely(i)) continue;
    if ((q[i] <= limits_.lower[i] && step[k] < 0) || (q[i] >= limits_.upper[i] && step[k] > 0)) {
      rest.col(k).setZero();
      held = true;
    }
  }
  return held ? solve(rest) : step;
}

NumericArm::Step NumericArm::idle_step(const Jacobian& jacobian, const JointVector& q,
                                       const JointVector& posture) const {
  Step towards(jacobian.cols());
  for (Eigen::Index i = 0; i < towards.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    towards[i] = posture[k] - q[k];
  }
  const Eigen::Matrix<double, 6, 6> square =
      jacobian * jacobian.transpose() + 1e-9 * Eigen::Matrix<double, 6, 6>::Identity();
  return towards - jacobian.transpose() * square.ldlt().solve(jacobian * towards);
}

void NumericArm::take(const Step& step, JointVector& q) const {
  const double largest = step.cwiseAbs().maxCoeff();
  const double share = largest > kLargestStep_rad ? kLargestStep_rad / largest : 1;
  for (std::size_t i = 0; i < hinges_.size(); ++i) {
    q[i] += share * step[static_cast<Eigen::Index>(i)];
    if (!turns_freely(i)) q[i] = std::clamp(q[i], limits_.lower[i], limits_.upper[i]);
  }
}

bool NumericArm::converge(const Pose& wanted, JointVector& q, int steps) const {
  Jacobian jacobian;
  for (int i = 0;; ++i) {
    const Pose tool = forward(q, &jacobian);
    Vector6 error;
    error << wanted.position - tool.position, turn_between(tool.rotation.toRotationMatrix(), wanted.rotation);
    const double size = error.norm();
    if (!std::isfinite(size)) return false;
    if (size < kDone || i == steps) return size < kGoodEnough;
    take(damped_step(jacobian, error, q), q);
  }
}

double NumericArm::manipulability(const JointVector& q) const {
  Jacobian jacobian;
  forward(q, &jacobian);
  const Eigen::Matrix<double, 6, 6> square = jacobian * jacobian.transpose();
  return std::sqrt(std::max(0.0, square.determinant()));
}

std::optional<JointVector> NumericArm::solve_from(const Pose& wanted, const JointVector& start,
                                                  const JointVector& posture) const {
  JointVector q = start;
  if (!converge(wanted, q, kSteps)) return std::nullopt;
  for (int round = 0; hinges_.size() > 6 && round < kIdleRounds; ++round) {
    Jacobian jacobian;
    forward(q, &jacobian);
    const Step idle = idle_step(jacobian, q, posture);
    if (idle.cwiseAbs().maxCoeff() < kIdle_rad) break;
    JointVector next = q;
    take(0.5 * idle, next);
    if (!converge(wanted, next, 8)) break;
    q = next;
  }
  if (!into_limits(q, start)) return std::nullopt;
  return q;
}

bool NumericArm::turns_freely(std::size_t joint) const {
  return limits_.upper[joint] - limits_.lower[joint] >= kTurn - 1e-6;
}

/// Whole turns are as good: the one nearest to `near`.
bool NumericArm::into_limits(JointVector& q, const JointVector& near) const {
  for (std::size_t i = 0; i < hinges_.size(); ++i) {
    if (!turns_freely(i)) continue;
    q[i] = near[i] + std::remainder(q[i] - near[i], kTurn);
    if (q[i] < limits_.lower[i]) q[i] += kTurn;
    if (q[i] > limits_.upper[i]) q[i] -= kTurn;
  }
  return limits_.contain(q);
}

std::vector<JointVector> NumericArm::solve_all(const Pose& wanted, const JointVector& near) const {
  std::vector<JointVector> found;
  const auto try_from = [&](const JointVector& start, const JointVector& posture) {
    auto q = solve_from(wanted, start, posture);
    if (!q || !into_limits(*q, near)) return false;
    const bool known = std::any_of(found.begin(), found.end(), [&](const JointVector& other) {
      return joint_distance(*q, other) < kApart_rad;
    });
    if (!known) found.push_back(*q);
    return !known;
  };
  try_from(near, near);
  try_from(home_, near);
  std::mt19937_64 random(1);
  int in_vain = 0;
  for (int i = 0; i < kStarts && (in_vain < kStartsInVain || found.empty()); ++i) {
    JointVector start{};
    for (std::size_t k = 0; k < hinges_.size(); ++k) {
      const double share = double(random() >> 11) * 0x1.0p-53;
      start[k] = std::lerp(limits_.lower[k], limits_.upper[k], share);
    }
    in_vain = try_from(start, start) ? 0 : in_vain + 1;
  }
  std::stable_sort(found.begin(), found.end(), [&](const JointVector& a, const JointVector& b) {
    return joint_distance(a, near) < joint_distance(b, near);
  });
  return found;
}

}  // namespace flowscope
