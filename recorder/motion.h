// From a wanted tool pose to a simulated motion: inverse kinematics, planning, following.
#pragma once

#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "recorder/planner.h"
#include "recorder/world.h"

namespace flowscope {

enum class MotionFailure { none, unreachable, in_collision, timed_out, not_reached, cancelled, simulation };
const char* to_string(MotionFailure failure);

struct MotionResult {
  MotionFailure failure = MotionFailure::none;
  std::string message;                       ///< for people: which pose, what is in the way, how far off
  std::optional<Pose> world_from_tool = {};  ///< the pose that a failed move was to reach
  explicit operator bool() const { return failure == MotionFailure::none; }
};

/// Called after every 20 Hz frame of any motion; return false to stop early (success reached, viewer
/// cancelled).
using FrameSink = std::function<bool(const Frame&)>;

struct MoveRequest {
  Pose world_from_tool;
  bool linear = false;
  bool ignore_collisions = false;
  std::uint64_t seed = 0;    ///< planner's random numbers
  double time_limit_s = 30;  ///< planning, wall clock: a guard that can only fail a move (planner.h)
  /// Straight tool lines that are going to follow: among the postures that reach the pose, a planned move
  /// prefers those from which these are possible.
  std::vector<Pose> then;
};

/// Inverse kinematics on the Panda in `world`: the best collision-free postures (posture.h). Plans (OMPL
/// RRTConnect with MuJoCo as checker, or a straight tool line), times within velocity and acceleration
/// limits, checks what will be commanded at finer resolution, and follows. With `ignore_collisions` what the
/// hand touches is no reason against a motion, but among several the arm's links decide. Stops moving as soon
/// as `sink` returns false (that is not a failure).
MotionResult move_to(World& world, const MoveRequest& request, const FrameSink& sink,
                     std::stop_token stop = {});
/// What move_to would command, one target per 20 Hz frame, without moving.
struct PlannedMove {
  MotionResult result;
  JointPath targets;
};
PlannedMove plan_move(World& world, const MoveRequest& request, std::stop_token stop = {});
/// Fingers to `openness`, arm still; grasps after closing, releases before opening.
MotionResult move_gripper(World& world, double openness, const FrameSink& sink, std::stop_token stop = {});

}  // namespace flowscope
