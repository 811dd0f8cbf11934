#include "recorder/motion.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>

#include "recorder/collision.h"
#include "recorder/trajectory.h"

namespace flowscope {
namespace {

constexpr std::size_t kMostGoals = 12;     ///< postures offered to the planner
constexpr std::size_t kMostDeadEnds = 60;  ///< tried before giving up on the lines that follow
constexpr double kGoalsApart_rad = 0.2;    ///< nearer ones are no real choice
constexpr int kSettleFrames = 6;           ///< at most, after the last target
constexpr double kStill_rad_s = 0.1;       ///< the keyframe rule's bound
constexpr double kReached_m = 0.005, kReached_rad = 2 * std::numbers::pi / 180;
constexpr int kGripperFrames = 2;  ///< a gripper move must not look like a stop of its own
constexpr double kWithdraw_m = 0.03;
constexpr double kLinearCheck_rad = 0.01;
constexpr double kExecutedCheck_rad = 0.0025;  ///< of what is commanded: finer than any search
/// How far corners may be cut, the roundest first; at none the arm would stop at each.
constexpr std::array kCorners_rad{0.3, 0.1, 0.03, 0.01, 0.003, 0.001, 0.0003, 0.0};
constexpr double kLookAhead_rad = 0.04;  ///< of motions that are only being considered

template <typename... Args>
std::string text(const char* format, Args... args) {
  char buffer[256];
  std::snprintf(buffer, sizeof buffer, format, args...);
  return buffer;
}

std::string place_of(const Pose& pose) {
  return text("(%.3f, %.3f, %.3f) m", pose.position.x(), pose.position.y(), pose.position.z());
}

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

MotionResult failed(MotionFailure failure, std::string message) { return {failure, std::move(message)}; }

MotionResult no_robot() {
  return failed(MotionFailure::unreachable,
                "the scene is open for viewing: nothing says which robot is in it");
}

class Mover {
 public:
  Mover(World& world, const MoveRequest& request, std::stop_token stop)
      : world_(world),
        request_(request),
        stop_(std::move(stop)),
        kinematics_(Kinematics::from_model(world.model(), world.task().robot())),
        start_(world.frame().q) {}

  PlannedMove plan() {
    PlannedMove move;
    move.result = request_.linear ? straight(move.targets) : planned(move.targets);
    name_pose(move.result);
    return move;
  }
  MotionResult run(const FrameSink& sink) {
    const PlannedMove move = plan();
    if (!move.result) return move.result;
    MotionResult result = follow(move.targets, sink);
    name_pose(result);
    return result;
  }

 private:
  /// Whoever cancelled knows that it did not get there.
  void name_pose(MotionResult& result) const {
    if (!result && result.failure != MotionFailure::cancelled)
      result.world_from_tool = request_.world_from_tool;
  }

  std::string goal_text() const { return "the tool pose at " + place_of(request_.world_from_tool); }

  MotionResult straight(JointPath& targets) const {
    CollisionChecker checker(world_);
    const IsFree is_free = [&](const JointVector& q) {
      return request_.ignore_collisions ? checker.links_are_free(q) : checker.is_free(q);
    };
    const auto accept = [&](const JointPath& path) { return path_is_free(path, is_free, kLinearCheck_rad); };
    double reached = 0;
    const JointPath path =
        straight_tool_path(kinematics_, start_, request_.world_from_tool, &reached, accept);
    if (path.empty()) {
      return failed(
          MotionFailure::unreachable,
          std::string("a straight line to ") + goal_text() +
              text(" leaves the arm's reach or joint limits after %.0f %% of the way", 100 * reached));
    }
    targets = timed_targets(path, world_.task().robot().limits);
    if (request_.ignore_collisions) return {};
    if (const auto q = first_collision(targets, is_free)) {
      const double whole = position_error_m(kinematics_.world_from_tool(start_), request_.world_from_tool);
      const double left = position_error_m(kinematics_.world_from_tool(*q), request_.world_from_tool);
      const double share = whole > 0 ? std::clamp(1 - left / whole, 0.0, 1.0) : 1;
      return failed(MotionFailure::in_collision,
                    "a straight line to " + goal_text() +
                        text(" collides after %.0f %% of the way: ", 100 * share) + checker.describe(*q));
    }
    return {};
  }

  /// What will be commanded, at the resolution of what is executed: the first posture that is not free.
  std::optional<JointVector> first_collision(const JointPath& targets, const IsFree& is_free) const {
    JointVector from = start_;
    for (const auto& to : targets) {
      if (!segment_is_free(from, to, is_free, kExecutedCheck_rad)) {
        const int steps =
            std::max(1, static_cast<int>(std::ceil(joint_distance(from, to) / kExecutedCheck_rad)));
        for (int i = 1; i <= steps; ++i) {
          const JointVector q = joints_between(from, to, double(i) / steps);
          if (!is_free(q)) return q;
        }
      }
      from = to;
    }
    return {};
  }

  /// Back along the tool's own axis: a hand that leaves sideways what it has just pressed would scrape along
  /// it.
  JointPath withdraw(const IsFree& is_free) const {
    Pose back = kinematics_.world_from_tool(start_);
    back.position -= kWithdraw_m * (back.rotation * Eigen::Vector3d::UnitZ());
    const JointPath path = straight_tool_path(kinematics_, start_, back);
    if (path.empty() || !path_is_free(path, is_free, kLinearCheck_rad)) return {start_};
    // So short a line is straight in joint space too; fewer corners are rounder ones.
    const JointPath direct{start_, path.back()};
    return path_is_free(direct, is_free, kLinearCheck_rad) ? direct : path;
  }

  enum class Onward { no, with_touch, free };
  /// Whether the lines that follow are possible from `q`, and without the arm's links touching anything. What
  /// the hand touches then is for those moves to say: things will have moved.
  Onward onward(JointVector q, CollisionChecker& checker) const {
    const auto is_free = [&](const JointVector& at) { return checker.links_are_free(at); };
    Onward result = Onward::free;
    for (const auto& pose : request_.then) {
      bool free = false;
      const auto accept = [&](const JointPath& path) {
        return free = path_is_free(path, is_free, kLookAhead_rad);
      };
      const JointPath path = straight_tool_path(kinematics_, q, pose, nullptr, accept);
      if (path.empty()) return Onward::no;
      if (!free) result = Onward::with_touch;
      q = path.back();
    }
    return result;
  }

  /// Free postures, clearly different from each other, the best first; those from which the lines that follow
  /// touch something or are impossible only if no others exist.
  std::vector<JointVector> choose_goals(const std::vector<JointVector>& postures, const IsFree& is_free,
                                        CollisionChecker& checker) const {
    std::vector<JointVector> good, touching, dead_ends;
    const auto is_known = [&](const JointVector& q) {
      const auto is_near = [&](const JointVector& known) {
        return joint_distance(q, known) < kGoalsApart_rad;
      };
      return std::ranges::any_of(good, is_near) || std::ranges::any_of(touching, is_near) ||
             std::ranges::any_of(dead_ends, is_near);
    };
    for (const auto& q : postures) {
      if (good.size() == kMostGoals || touching.size() + dead_ends.size() == kMostDeadEnds) break;
      if (is_known(q) || !is_free(q)) continue;
      const Onward next = onward(q, checker);
      (next == Onward::free ? good : next == Onward::with_touch ? touching : dead_ends).push_back(q);
    }
    auto& best = !good.empty() ? good : !touching.empty() ? touching : dead_ends;
    best.resize(std::min(best.size(), kMostGoals));
    return best;
  }

  /// Straight through joint space to a posture for which the arm's links touch nothing on the way, if there
  /// is one; the hand may touch anything.
  JointPath unchecked(const std::vector<JointVector>& postures) const {
    CollisionChecker checker(world_);
    const auto is_free = [&](const JointVector& q) { return checker.links_are_free(q); };
    const auto best = std::ranges::find_if(
        postures, [&](const JointVector& q) { return segment_is_free(start_, q, is_free, kLookAhead_rad); });
    return {start_, best != postures.end() ? *best : postures.front()};
  }

  MotionResult planned(JointPath& targets) const {
    const auto postures = kinematics_.solve_all(request_.world_from_tool, start_);
    if (postures.empty()) {
      return failed(MotionFailure::unreachable, goal_text() + " is out of the arm's reach or joint limits");
    }
    if (request_.ignore_collisions) {
      targets = timed_targets(unchecked(postures), world_.task().robot().limits);
      return {};
    }
    CollisionChecker checker(world_);
    const IsFree is_free = [&](const JointVector& q) { return checker.is_clear(q); };
    const JointPath retreat = checker.touches_at_start() ? withdraw(is_free) : JointPath{start_};
    if (retreat.size() > 1) checker.forget_start();
    const std::vector<JointVector> goals = choose_goals(postures, is_free, checker);
    if (goals.empty()) {
      return failed(
          MotionFailure::in_collision,
          goal_text() + " collides in every posture, in the nearest: " + checker.describe(postures.front()));
    }
    PlanLimits search;
    search.seed = request_.seed;
    search.time_limit_s = request_.time_limit_s;
    const Plan plan = plan_joint_path(retreat.back(), goals, kinematics_.limits(), is_free, search, stop_);
    switch (plan.outcome) {
      case PlanOutcome::solved:
        if (retreat.size() == 1) return timed(plan.path, is_free, checker, targets);
        return timed_with(retreat, plan.path, targets);
      case PlanOutcome::cancelled:
        return failed(MotionFailure::cancelled, "cancelled while planning");
      case PlanOutcome::timed_out:
        return failed(MotionFailure::timed_out, std::string("no collision-free path to ") + goal_text() +
                                                    text(" within %.1f s", search.time_limit_s));
      case PlanOutcome::no_path:
        break;
    }
    return failed(MotionFailure::timed_out, std::string("no collision-free path to ") + goal_text() +
                                                text(" within %d tries", search.iterations));
  }

  /// The retreat begins where things touch that may.
  MotionResult timed_with(JointPath path, const JointPath& plan, JointPath& targets) const {
    path.insert(path.end(), plan.begin() + 1, plan.end());
    CollisionChecker checker(world_);
    return timed(
        path, [&](const JointVector& q) { return checker.is_clear(q); }, checker, targets);
  }

  /// With corners as round as the room around them allows.
  MotionResult timed(const JointPath& path, const IsFree& is_free, CollisionChecker& checker,
                     JointPath& targets) const {
    std::optional<JointVector> hit;
    for (const double corner_rad : kCorners_rad) {
      targets = timed_targets(path, world_.task().robot().limits, corner_rad);
      hit = first_collision(targets, is_free);
      if (!hit) return {};
    }
    return failed(MotionFailure::in_collision,
                  "the path to " + goal_text() + " is too narrow to be followed: " + checker.describe(*hit));
  }

  MotionResult follow(const JointPath& targets, const FrameSink& sink) const {
    Run run(world_, sink, stop_);
    const double openness = world_.openness_target();
    for (const auto& target : targets) {
      if (!run.advance(target, openness)) return ended(run);
    }
    // No longer than until the arm counts as still: a gripper move that comes next then belongs to this stop.
    for (int i = 0; i < kSettleFrames && !still(world_.frame()); ++i) {
      if (!run.advance(targets.empty() ? start_ : targets.back(), openness)) return ended(run);
    }
    const Pose tool = world_.frame().world_from_tool;
    const double off_m = position_error_m(tool, request_.world_from_tool);
    const double off_rad = rotation_error_rad(tool, request_.world_from_tool);
    // A move that may touch things (pressing, pulling) is often stopped by them: whether it did what it
    // should is for the task's success to say. Any other move must arrive.
    if (!request_.ignore_collisions && (off_m > kReached_m || off_rad > kReached_rad)) {
      return failed(MotionFailure::not_reached, text("the tool stopped %.1f mm and %.1f deg from ",
                                                     1000 * off_m, off_rad * 180 / std::numbers::pi) +
                                                    goal_text());
    }
    return {};
  }

  static bool still(const Frame& frame) {
    return std::all_of(frame.dq.begin(), frame.dq.end(),
                       [](double dq) { return std::abs(dq) <= kStill_rad_s; });
  }

  static MotionResult ended(const Run& run) {
    return run.cancelled() ? failed(MotionFailure::cancelled, "cancelled") : MotionResult{};
  }

  World& world_;
  const MoveRequest& request_;
  std::stop_token stop_;
  Kinematics kinematics_;
  JointVector start_;
};

}  // namespace

const char* to_string(MotionFailure failure) {
  switch (failure) {
    case MotionFailure::none:
      return "none";
    case MotionFailure::unreachable:
      return "unreachable";
    case MotionFailure::in_collision:
      return "in_collision";
    case MotionFailure::timed_out:
      return "timed_out";
    case MotionFailure::not_reached:
      return "not_reached";
    case MotionFailure::cancelled:
      return "cancelled";
    case MotionFailure::simulation:
      return "simulation";
  }
  return "unknown";
}

MotionResult move_to(World& world, const MoveRequest& request, const FrameSink& sink, std::stop_token stop) {
  if (world.task().robot().joints.empty()) return no_robot();
  try {
    return Mover(world, request, std::move(stop)).run(sink);
  } catch (const SimulationFailed& error) {
    return failed(MotionFailure::simulation, error.what());
  }
}

PlannedMove plan_move(World& world, const MoveRequest& request, std::stop_token stop) {
  if (world.task().robot().joints.empty()) return {no_robot(), {}};
  return Mover(world, request, std::move(stop)).plan();
}

MotionResult move_gripper(World& world, double openness, const FrameSink& sink, std::stop_token stop) {
  if (world.task().robot().joints.empty()) return no_robot();
  try {
    const JointVector q = world.joint_targets();
    const double before = world.openness_target();
    const bool closing = openness < before;
    if (!closing) world.release();
    Run run(world, sink, std::move(stop));
    for (int i = 0; i < kGripperFrames; ++i) {
      // Fingers open at once, but they close on things: evenly, or they would squeeze a light object out of
      // its place.
      const double share = closing ? double(i + 1) / kGripperFrames : 1;
      if (!run.advance(q, std::lerp(before, openness, share))) {
        return run.cancelled() ? failed(MotionFailure::cancelled, "cancelled") : MotionResult{};
      }
    }
    if (closing) world.grasp();
    return {};
  } catch (const SimulationFailed& error) {
    return failed(MotionFailure::simulation, error.what());
  }
}

}  // namespace flowscope
