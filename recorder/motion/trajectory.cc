#include "recorder/motion/trajectory.h"

#include <algorithm>
#include <cmath>

#include "recorder/frame_time.h"
#include "recorder/motion/time_law.h"

namespace flowscope {
namespace {

constexpr double kLineStep_m = 0.004, kLineStep_rad = 0.02;
constexpr int kLineEnds = 96;  ///< values of q7 at a line's end: most lead out of some joint's limits
constexpr double kLargestJump_rad = 0.12;  ///< between two points of a line; a change of branch is far more
/// How often a step with a larger one is cut in two: near a singularity joints turn far while the tool hardly
/// moves, but they turn less in a smaller step; a change of branch stays as large.
constexpr int kHalvings = 5;

Pose between(const Pose& a, const Pose& b, double share) {
  return {a.position + share * (b.position - a.position), a.rotation.slerp(share, b.rotation)};
}

/// A line with what the poses leave open going evenly to `goal`'s, every other joint following its branch.
class Branch {
 public:
  Branch(const Kinematics& kinematics, const JointVector& start, const Pose& from, const Pose& to,
         const JointVector& goal)
      : kinematics_(kinematics), start_(start), from_(from), to_(to), goal_(goal), path_{start} {}

  /// In so many steps, or in smaller ones where it must and `halvings` allow. The share of the line up to
  /// where that breaks: 1 if it does not.
  double follow(int steps, int halvings) {
    for (int i = 0; i < steps; ++i) {
      if (!step(double(i) / steps, double(i + 1) / steps, halvings)) return double(i) / steps;
    }
    return 1;
  }
  JointPath& path() { return path_; }

 private:
  bool step(double from_share, double share, int halvings) {
    JointVector posture{};
    for (std::size_t k = 0; k < posture.size(); ++k) posture[k] = std::lerp(start_[k], goal_[k], share);
    const auto next = kinematics_.follow(between(from_, to_, share), path_.back(), posture);
    if (!next) return false;
    if (joint_distance(*next, path_.back()) <= kLargestJump_rad) {
      path_.push_back(*next);
      return true;
    }
    const double middle = (from_share + share) / 2;
    return halvings > 0 && step(from_share, middle, halvings - 1) && step(middle, share, halvings - 1);
  }

  const Kinematics& kinematics_;
  const JointVector& start_;
  const Pose &from_, &to_;
  const JointVector& goal_;
  JointPath path_;
};

}  // namespace

JointPath timed_targets(const JointPath& path, const MotionLimits& limits, double corner_rad) {
  const RoundedPath rounded(path, corner_rad);
  const TimeLaw law(rounded, limits);
  if (law.duration_s() <= 0) return {};
  // A whole number of frames: a little slower than the limits would allow.
  const int frames = std::max(1, static_cast<int>(std::ceil(law.duration_s() / frame_s - 1e-9)));
  JointPath targets;
  for (int frame = 1; frame < frames; ++frame) {
    targets.push_back(rounded.at(law.at(law.duration_s() * frame / frames)));
  }
  targets.push_back(path.back());
  return targets;
}

JointPath straight_tool_path(const Kinematics& kinematics, const JointVector& start,
                             const Pose& world_from_tool, double* reached,
                             const std::function<bool(const JointPath&)>& accept, LineEffort effort) {
  const Pose from = kinematics.world_from_tool(start);
  const double steps_position = position_error_m(from, world_from_tool) / kLineStep_m;
  const double steps_rotation = rotation_error_rad(from, world_from_tool) / kLineStep_rad;
  if (reached) *reached = 0;
  if (!std::isfinite(steps_position + steps_rotation)) return {};
  constexpr double most = 10'000;  // far beyond any arm's reach: there the kinematics say no
  const double wanted = std::ceil(std::max(steps_position, steps_rotation));
  const int steps = static_cast<int>(std::clamp(wanted, 1.0, most));
  // Not only the end's nearest posture: a farther q7 may be the one that keeps every joint within its limits.
  const bool seven = kinematics.limits().joints == 7;  // then the seventh says how the line is followed
  const auto goals = kinematics.solve_all(world_from_tool, start, kLineEnds);
  JointPath first;
  for (const int halvings : {0, kHalvings}) {
    if (halvings > 0 && effort == LineEffort::quick) break;
    std::vector<double> tried;
    for (const auto& goal : goals) {
      if (seven && std::ranges::find(tried, goal[6]) != tried.end()) continue;
      tried.push_back(goal[6]);
      Branch branch(kinematics, start, from, world_from_tool, goal);
      const double share = branch.follow(steps, halvings);
      if (reached) *reached = std::max(*reached, share);
      if (share < 1) continue;
      if (!accept || accept(branch.path())) return std::move(branch.path());
      if (first.empty()) first = std::move(branch.path());
    }
    if (!first.empty()) break;
  }
  return first;
}

}  // namespace flowscope
