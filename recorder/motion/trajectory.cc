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
                             const std::function<bool(const JointPath&)>& accept) {
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
  std::vector<double> tried;
  JointPath first;
  for (const auto& goal : kinematics.solve_all(world_from_tool, start, kLineEnds)) {
    if (seven && std::ranges::find(tried, goal[6]) != tried.end()) continue;
    tried.push_back(goal[6]);
    JointPath path = follow_branch(kinematics, start, from, world_from_tool, goal, steps);
    if (reached) *reached = std::max(*reached, double(path.size() - 1) / steps);
    if (static_cast<int>(path.size()) != steps + 1) continue;
    if (!accept || accept(path)) return path;
    if (first.empty()) first = std::move(path);
  }
  return first;
}

}  // namespace flowscope
