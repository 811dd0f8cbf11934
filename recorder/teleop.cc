#include "recorder/teleop.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "recorder/frame_time.h"
#include "recorder/motion/collision.h"
#include "recorder/motion/kinematics.h"

namespace flowscope {
namespace {

constexpr double kSpeedUp = 0.8, kSlowDown = 2.5;  ///< m/s^2
constexpr double kSpinUp = 4, kSpinDown = 12;      ///< rad/s^2
constexpr double kLag_m = 0.015;      ///< the tool this far behind what it was told is being held back
constexpr int kSettleFrames = 6;      ///< at most, until the arm counts as still
constexpr double kStill_rad_s = 0.1;  ///< the keyframe rule's bound
constexpr int kHalvings = 4;
constexpr double kAtLimit_rad = 0.02;

std::string millimetres(double metres) {
  char text[32];
  std::snprintf(text, sizeof text, "%.0f mm", 1000 * metres);
  return text;
}

/// Towards `wanted` by at most `up` away from zero or `down` towards it.
Eigen::Vector3d ramped(const Eigen::Vector3d& now, const Eigen::Vector3d& wanted, double up, double down) {
  const Eigen::Vector3d change = wanted - now;
  const double most = wanted.squaredNorm() >= now.squaredNorm() ? up : down;
  const double length = change.norm();
  return length <= most ? wanted : Eigen::Vector3d(now + change * (most / length));
}

Eigen::Vector3d cut(const Eigen::Vector3d& v, double limit) { return v.cwiseMax(-limit).cwiseMin(limit); }

/// Without a closed form's parameter to choose, so that the joints move as little and as evenly as they can:
/// numerically, from the posture before.
Kinematics step_by_step(const World& world) {
  RobotDescription robot = world.task().robot();
  robot.inverse_kinematics = InverseKinematics::numeric;
  return Kinematics::from_model(world.model(), robot);
}

}  // namespace

const char* to_string(JogState state) {
  switch (state) {
    case JogState::still:
      return "still";
    case JogState::moving:
      return "moving";
    case JogState::blocked:
      return "blocked";
    case JogState::unreachable:
      return "unreachable";
  }
  return "unknown";
}

struct Jogger::Impl {
  explicit Impl(World& its_world)
      : world(its_world),
        kinematics(step_by_step(its_world)),
        q(its_world.joint_targets()),
        posture(q),
        openness(its_world.openness_target()) {
    goal = kinematics.world_from_tool(q);
  }

  JogStep stopped(JogState state, std::string message) {
    linear.setZero();
    angular.setZero();
    goal = kinematics.world_from_tool(q);
    JogStep step = settle();
    step.state = state;
    step.message = std::move(message);
    return step;
  }

  /// A stop must look like one: frames are added until the arm stands still.
  JogStep settle() {
    JogStep step;
    if (settling == 0) return step;
    step.frame = world.advance(q, openness);
    --settling;
    if (std::all_of(step.frame->dq.begin(), step.frame->dq.end(),
                    [](double dq) { return std::abs(dq) <= kStill_rad_s; }))
      settling = 0;
    return step;
  }

  Pose moved(double seconds) const {
    const double angle = angular.norm() * seconds;
    Pose next = goal;
    next.position += linear * seconds;
    if (angle > 0) {
      next.rotation =
          (Eigen::Quaterniond(Eigen::AngleAxisd(angle, angular.normalized())) * goal.rotation).normalized();
    }
    return next;
  }

  /// The longest part of a frame's way that the joints can go; empty when there is none.
  std::optional<JointVector> next(Pose& pose) const {
    const double most = world.task().robot().limits.velocity * frame_s;
    double seconds = frame_s;
    for (int i = 0; i <= kHalvings; ++i, seconds /= 2) {
      pose = moved(seconds);
      const auto solved = kinematics.follow(pose, q, posture);
      if (solved && joint_distance(*solved, q) <= most) return solved;
      if (stuck) break;  // only a whole step leads on from where the arm ended: no creeping
    }
    return std::nullopt;
  }

  std::string why_unreachable() const {
    const JointLimits& limits = kinematics.limits();
    for (std::size_t i = 0; i < limits.joints; ++i) {
      if (q[i] < limits.lower[i] + kAtLimit_rad || q[i] > limits.upper[i] - kAtLimit_rad)
        return "joint " + std::to_string(i + 1) + " is at its limit";
    }
    return "the arm is stretched out, or would have to turn over";
  }

  World& world;
  Kinematics kinematics;
  JointVector q;        ///< last told
  JointVector posture;  ///< what joints to spare keep to: where this movement began
  double openness;
  Pose goal;  ///< what was last told
  Eigen::Vector3d linear = Eigen::Vector3d::Zero(), angular = Eigen::Vector3d::Zero();  ///< world
  int settling = 0;
  bool stuck = false;  ///< the last step led out of reach
};

Jogger::Jogger(World& world) : impl_(std::make_unique<Impl>(world)) {}
Jogger::~Jogger() = default;
Jogger::Jogger(Jogger&&) noexcept = default;
Jogger& Jogger::operator=(Jogger&&) noexcept = default;

bool Jogger::at_rest() const {
  return impl_->linear.isZero() && impl_->angular.isZero() && impl_->settling == 0;
}

JogStep Jogger::step(const JogCommand& command) {
  Impl& me = *impl_;
  const Eigen::Quaterniond axes =
      command.in_tool_frame ? me.goal.rotation : Eigen::Quaterniond(Eigen::Quaterniond::Identity());
  const Eigen::Vector3d linear = axes * cut(command.linear_m_s, jog_limit_m_s);
  const Eigen::Vector3d angular = axes * cut(command.angular_rad_s, jog_limit_rad_s);
  if (me.stuck) {
    me.linear = linear;
    me.angular = angular;
  } else {
    me.linear = ramped(me.linear, linear, kSpeedUp * frame_s, kSlowDown * frame_s);
    me.angular = ramped(me.angular, angular, kSpinUp * frame_s, kSpinDown * frame_s);
  }
  if (me.linear.isZero() && me.angular.isZero()) {
    me.stuck = false;
    return me.settle();
  }

  const double lag = position_error_m(me.world.robot().world_from_tool, me.goal);
  Pose pose;
  const auto q = me.next(pose);
  me.stuck = !q;
  if (!q) return me.stopped(JogState::unreachable, me.why_unreachable());
  if (lag > kLag_m && position_error_m(me.world.robot().world_from_tool, pose) >= lag)
    return me.stopped(JogState::blocked, "something holds the tool back by " + millimetres(lag));
  if (!command.may_touch) {
    CollisionChecker checker(me.world);
    if (!checker.is_free(*q)) return me.stopped(JogState::blocked, checker.describe(*q));
  }
  me.q = *q;
  me.goal = pose;
  me.settling = kSettleFrames;
  return {JogState::moving, "", me.world.advance(me.q, me.openness)};
}

}  // namespace flowscope
