#include "recorder/motion/goal_choice.h"

#include <algorithm>
#include <array>

#include "recorder/motion/trajectory.h"

namespace flowscope {
namespace {

constexpr std::size_t kMostGoals = 12;     ///< postures offered to the planner
constexpr std::size_t kMostDeadEnds = 60;  ///< tried before giving up on the lines that follow
/// Values of a Panda's seventh joint that are tried, the next when none of the first leads on.
constexpr std::array kSweeps{32, 128};
constexpr double kGoalsApart_rad = 0.2;  ///< nearer ones are no real choice
constexpr double kLookAhead_rad = 0.04;  ///< lines that are only being considered are looked at as often

Goals best_of(const std::vector<JointVector>& postures, const LookAhead& ahead, const IsFree& is_free,
              CollisionChecker& checker) {
  std::vector<JointVector> good, touching, dead_ends;
  const auto is_known = [&](const JointVector& q) {
    const auto is_near = [&](const JointVector& known) { return joint_distance(q, known) < kGoalsApart_rad; };
    return std::ranges::any_of(good, is_near) || std::ranges::any_of(touching, is_near) ||
           std::ranges::any_of(dead_ends, is_near);
  };
  for (const auto& q : postures) {
    if (good.size() == kMostGoals || touching.size() + dead_ends.size() == kMostDeadEnds) break;
    if (is_known(q) || !is_free(q)) continue;
    const Onward next = ahead.from(q, checker);
    (next == Onward::free ? good : next == Onward::with_touch ? touching : dead_ends).push_back(q);
  }
  Goals goals;
  goals.onward = !good.empty() ? Onward::free : !touching.empty() ? Onward::with_touch : Onward::no;
  goals.postures = std::move(!good.empty() ? good : !touching.empty() ? touching : dead_ends);
  goals.postures.resize(std::min(goals.postures.size(), kMostGoals));
  return goals;
}

}  // namespace

Onward LookAhead::from(JointVector q, CollisionChecker& checker) const {
  const auto is_free = [&](const JointVector& at) { return checker.links_are_free(at); };
  Onward result = Onward::free;
  for (const auto& pose : then_) {
    bool free = false;
    const auto accept = [&](const JointPath& path) {
      return free = path_is_free(path, is_free, kLookAhead_rad);
    };
    const JointPath path = straight_tool_path(kinematics_, q, pose, nullptr, accept, LineEffort::quick);
    if (path.empty()) return Onward::no;
    if (!free) result = Onward::with_touch;
    q = path.back();
  }
  return result;
}

Goals choose_goals(const Kinematics& kinematics, const Pose& world_from_tool, const JointVector& start,
                   const LookAhead& ahead, const IsFree& is_free, CollisionChecker& checker) {
  Goals best;
  std::optional<JointVector> nearest;
  // Of few postures none may be free and lead on: then of more, if these are any better.
  for (const int samples : kSweeps) {
    const auto swept = kinematics.solve_all(world_from_tool, start, samples);
    Goals goals = best_of(swept, ahead, is_free, checker);
    if (!nearest && !swept.empty()) nearest = swept.front();
    if (best.postures.empty() || goals.onward > best.onward) best = std::move(goals);
    if (!best.postures.empty() && best.onward == Onward::free) break;
    if (kinematics.limits().joints < 7) break;  // no seventh joint to sweep: the same postures again
  }
  best.nearest = nearest;
  return best;
}

}  // namespace flowscope
