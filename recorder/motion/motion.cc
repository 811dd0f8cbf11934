#include "recorder/motion/motion.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>

namespace flowscope {
namespace {

constexpr int kSettleFrames = 6;      ///< at most, after the last target
constexpr double kStill_rad_s = 0.1;  ///< the keyframe rule's bound
constexpr double kReached_m = 0.005, kReached_rad = 2 * std::numbers::pi / 180;
constexpr int kGripperFrames = 2;  ///< a gripper move must not look like a stop of its own
constexpr int kSlowestGripperFrames = 40;
constexpr double kStuck = 0.002;  ///< opens by less in a frame

/// One motion in progress: sends frames on and knows when to end.
class Run {
 public:
  Run(World& world, const FrameSink& sink, std::stop_token stop)
      : world_(world), sink_(sink), stop_(std::move(stop)) {}
  /// False when the motion shall end here.
  bool advance(const JointVector& target, double openness) {
    if (stop_.stop_requested()) {
      cancelled_ = true;
      return false;
    }
    frame_ = world_.advance(target, openness);
    return !sink_ || sink_(*frame_);
  }
  bool cancelled() const { return cancelled_; }
  const std::optional<Frame>& frame() const { return frame_; }

 private:
  World& world_;
  const FrameSink& sink_;
  std::stop_token stop_;
  std::optional<Frame> frame_;
  bool cancelled_ = false;
};

MotionResult ended(const Run& run) {
  if (!run.cancelled()) return {};
  return {MotionFailure::cancelled, "cancelled", std::nullopt};
}

bool still(const Frame& frame) {
  return std::all_of(frame.dq.begin(), frame.dq.end(),
                     [](double dq) { return std::abs(dq) <= kStill_rad_s; });
}

MotionResult follow(World& world, const MoveRequest& request, const JointPath& targets, const FrameSink& sink,
                    std::stop_token stop) {
  const JointVector start = world.frame().q;
  const double openness = world.openness_target();
  Run run(world, sink, std::move(stop));
  for (const auto& target : targets) {
    if (!run.advance(target, openness)) return ended(run);
  }
  // No longer than until the arm counts as still: a gripper move that comes next then belongs to this stop.
  for (int i = 0; i < kSettleFrames && !still(world.frame()); ++i) {
    if (!run.advance(targets.empty() ? start : targets.back(), openness)) return ended(run);
  }
  const Pose tool = world.frame().world_from_tool;
  const double off_m = position_error_m(tool, request.world_from_tool);
  const double off_rad = rotation_error_rad(tool, request.world_from_tool);
  // A move that may touch things (pressing, pulling) is often stopped by them: whether it did what it should
  // is for the task's success to say. Any other move must arrive.
  if (request.ignore_collisions || (off_m <= kReached_m && off_rad <= kReached_rad)) return {};
  const Eigen::Vector3d& at = request.world_from_tool.position;
  char text[160];
  std::snprintf(text, sizeof text,
                "the tool stopped %.1f mm and %.1f deg from the tool pose at (%.3f, %.3f, %.3f) m",
                1000 * off_m, off_rad * 180 / std::numbers::pi, at.x(), at.y(), at.z());
  return {MotionFailure::not_reached, text, request.world_from_tool};
}

MotionResult failed(const SimulationFailed& error) {
  return {MotionFailure::simulation, error.what(), std::nullopt};
}

}  // namespace

MotionResult move_to(World& world, const MoveRequest& request, const FrameSink& sink, std::stop_token stop) {
  try {
    const PlannedMove move = plan_move(world, request, stop);
    if (!move.result) return move.result;
    return follow(world, request, move.targets, sink, std::move(stop));
  } catch (const SimulationFailed& error) {
    return failed(error);
  }
}

MotionResult move_gripper(World& world, double openness, const FrameSink& sink, std::stop_token stop) {
  if (world.task().robot().joints.empty()) return no_robot();
  try {
    const JointVector q = world.joint_targets();
    const double before = world.openness_target();
    const bool closing = openness<before, opening = openness> before;
    if (opening) world.release();  // told again to close, a hand keeps what it holds
    Run run(world, sink, std::move(stop));
    for (int i = 0; i < kGripperFrames; ++i) {
      // Fingers open at once, but they close on things: evenly, or they would squeeze a light object out of
      // its place.
      const double share = closing ? double(i + 1) / kGripperFrames : 1;
      if (!run.advance(q, std::lerp(before, openness, share))) {
        return ended(run);
      }
    }
    // A slow gripper must have let go before the arm leaves, or its opening would be recorded somewhere else.
    const bool wide = openness > fully_open;
    for (int i = 0; opening && wide && !run.frame()->gripper_open && i < kSlowestGripperFrames; ++i) {
      const double before_it = run.frame()->openness;
      if (!run.advance(q, openness)) return ended(run);
      if (run.frame()->openness < before_it + kStuck) break;
    }
    if (closing) world.grasp();
    return {};
  } catch (const SimulationFailed& error) {
    return failed(error);
  }
}

}  // namespace flowscope
