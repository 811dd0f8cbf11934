#include "recorder/trajectory.h"

#include <algorithm>
#include <cmath>

namespace flowscope {
namespace {

constexpr double kFrame_s = 0.05;
constexpr double kLineStep_m = 0.004, kLineStep_rad = 0.02;
constexpr double kLargestJump_rad = 0.12;  ///< between two points of a line; a change of branch is far more

/// A trapezoidal speed profile over a path of length `length` (seconds at full speed, so that the top speed
/// is 1).
class Profile {
 public:
  Profile(double length, double up, double down)
      : length_(length),
        up_(up),
        down_(down),
        peak_(std::min(1.0, std::sqrt(2 * length * up * down / (up + down)))) {}
  double duration() const { return length_ / peak_ + 0.5 * peak_ / up_ + 0.5 * peak_ / down_; }
  double at(double t) const {
    const double left = duration() - t;
    if (t < peak_ / up_) return 0.5 * up_ * t * t;
    if (left < peak_ / down_) return length_ - 0.5 * down_ * left * left;
    return peak_ * (t - 0.5 * peak_ / up_);
  }

 private:
  double length_, up_, down_, peak_;
};

Pose between(const Pose& a, const Pose& b, double share) {
  return {a.position + share * (b.position - a.position), a.rotation.slerp(share, b.rotation)};
}

/// The line with what the poses leave open going evenly to `goal`'s, every other joint following its branch.
/// Ends early where that breaks.
JointPath follow_branch(const Kinematics& kinematics, const JointVector& start, const Pose& from,
                        const Pose& to, const JointVector& goal, int steps) {
  JointPath path{start};
  for (int i = 1; i <= steps; ++i) {
    const double share = double(i) / steps;
    JointVector posture{};
    for (std::size_t k = 0; k < posture.size(); ++k) posture[k] = std::lerp(start[k], goal[k], share);
    const auto next = kinematics.follow(between(from, to, share), path.back(), posture);
    if (!next || joint_distance(*next, path.back()) > kLargestJump_rad) break;
    path.push_back(*next);
  }
  return path;
}

}  // namespace

JointPath timed_targets(const JointPath& path, const MotionLimits& limits) {
  std::vector<double> at{0};  // seconds at full speed from the start to each corner
  for (std::size_t i = 1; i < path.size(); ++i) {
    at.push_back(at.back() + joint_distance(path[i - 1], path[i]) / limits.velocity);
  }
  if (path.size() < 2 || at.back() <= 0) return {};
  const Profile profile(at.back(), limits.acceleration / limits.velocity,
                        limits.deceleration / limits.velocity);
  const int frames = std::max(1, static_cast<int>(std::ceil(profile.duration() / kFrame_s - 1e-9)));
  JointPath targets;
  std::size_t corner = 1;
  for (int frame = 1; frame < frames; ++frame) {
    const double s = profile.at(profile.duration() * frame / frames);
    while (corner + 1 < path.size() && at[corner] < s) ++corner;
    const double stretch = at[corner] - at[corner - 1];
    const double share = stretch > 0 ? std::clamp((s - at[corner - 1]) / stretch, 0.0, 1.0) : 1;
    JointVector q;
    for (std::size_t i = 0; i < q.size(); ++i) q[i] = std::lerp(path[corner - 1][i], path[corner][i], share);
    targets.push_back(q);
  }
  targets.push_back(path.back());
  return targets;
}

JointPath straight_tool_path(const Kinematics& kinematics, const JointVector& start,
                             const Pose& world_from_tool, double* reached) {
  const Pose from = kinematics.world_from_tool(start);
  const double steps_position = position_error_m(from, world_from_tool) / kLineStep_m;
  const double steps_rotation = rotation_error_rad(from, world_from_tool) / kLineStep_rad;
  if (reached) *reached = 0;
  if (!std::isfinite(steps_position + steps_rotation)) return {};
  constexpr double most = 10'000;  // far beyond any arm's reach: there the kinematics say no
  const double wanted = std::ceil(std::max(steps_position, steps_rotation));
  const int steps = static_cast<int>(std::clamp(wanted, 1.0, most));
  // Not only the end's nearest posture: a farther q7 may be the one that keeps every joint within its limits.
  for (const auto& goal : kinematics.solve_all(world_from_tool, start)) {
    JointPath path = follow_branch(kinematics, start, from, world_from_tool, goal, steps);
    if (static_cast<int>(path.size()) == steps + 1) return path;
    if (reached) *reached = std::max(*reached, double(path.size() - 1) / steps);
  }
  return {};
}

}  // namespace flowscope
