// From a wanted tool pose to what will be commanded: inverse kinematics, planning, timing.
#pragma once

#include <cstdint>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "recorder/motion/planner.h"

namespace flowscope {

class World;

enum class MotionFailure { none, unreachable, in_collision, timed_out, not_reached, cancelled, simulation };
const char* to_string(MotionFailure failure);

struct MotionResult {
  MotionFailure failure = MotionFailure::none;
  std::string message;                       ///< for people: which pose, what is in the way, how far off
  std::optional<Pose> world_from_tool = {};  ///< the pose that a failed move was to reach
  explicit operator bool() const { return failure == MotionFailure::none; }
};

/// Of any motion in a scene that is only open for viewing.
MotionResult no_robot();

struct MoveRequest {
  Pose world_from_tool;
  bool linear = false;
  bool ignore_collisions = false;
  bool may_push = false;     ///< on a straight line, things that joints let move are nothing in the way
  std::uint64_t seed = 0;    ///< planner's random numbers
  double time_limit_s = 30;  ///< planning, wall clock: a guard that can only fail a move (planner.h)
  /// Straight tool lines that are going to follow: among the postures that reach the pose, a move prefers
  /// those from which these are possible.
  std::vector<Pose> then;
  bool must_lead_on = false;  ///< a planned move fails as unreachable where they are possible from none
};

/// One target per 20 Hz frame; none where the world stands already.
struct PlannedMove {
  MotionResult result;
  JointPath targets;
};
/// Chooses among the collision-free postures that reach the pose (posture.h) and plans (OMPL RRTConnect with
/// MuJoCo as checker, or a straight tool line), times within velocity and acceleration limits, and checks
/// what will be commanded at finer resolution. With `ignore_collisions` what the hand touches is no reason
/// against a motion, but among several the arm's links decide.
///
/// A planned path whose corners have no room to be rounded is searched anew, a few times: at a corner that is
/// not round the arm stops, and a stop is a keyframe to those who read the demonstration. What the hand
/// carries keeps `CollisionChecker::carried_clearance_m` from things where a path allows it.
PlannedMove plan_move(const World& world, const MoveRequest& request, std::stop_token stop = {});

}  // namespace flowscope
