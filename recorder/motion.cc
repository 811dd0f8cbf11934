#include "recorder/motion.h"

#include <mujoco/mujoco.h>

#include <algorithm>
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
constexpr double kRoom_rad = 0.3;          ///< from a joint limit: enough
constexpr double kLackOfRoom = 5;     ///< how much farther, per rad of it lacking, another posture may be
constexpr int kSettleFrames = 6;      ///< at most, after the last target
constexpr double kStill_rad_s = 0.1;  ///< the keyframe rule's bound
constexpr double kReached_m = 0.005, kReached_rad = 2 * std::numbers::pi / 180;
constexpr int kGripperFrames = 2;  ///< a gripper move must not look like a stop of its own
constexpr double kWithdraw_m = 0.03;
constexpr double kLinearCheck_rad = 0.01;

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

  MotionResult run(const FrameSink& sink) {
    JointPath path;
    const MotionResult result = request_.linear ? straight(path) : planned(path);
    return result ? follow(path, sink) : result;
  }

 private:
  std::string goal_text() const { return "the tool pose at " + place_of(request_.world_from_tool); }

  MotionResult straight(JointPath& path) const {
    double reached = 0;
    path = straight_tool_path(kinematics_, start_, request_.world_from_tool, &reached);
    if (path.empty()) {
      return failed(
          MotionFailure::unreachable,
          std::string("a straight line to ") + goal_text() +
              text(" leaves the arm's reach or joint limits after %.0f %% of the way", 100 * reached));
    }
    if (request_.ignore_collisions) return {};
    CollisionChecker checker(world_);
    const IsFree is_free = [&](const JointVector& q) { return checker.is_free(q); };
    for (std::size_t i = 1; i < path.size(); ++i) {
      if (segment_is_free(path[i - 1], path[i], is_free, kLinearCheck_rad)) continue;
      std::string what = checker.describe(path[i]);
      if (what.empty()) what = checker.describe(path[i - 1]);
      return failed(MotionFailure::in_collision, "a straight line to " + goal_text() +
                                                     text(" collides after %.0f %% of the way: ",
                                                          100.0 * double(i) / double(path.size() - 1)) +
                                                     what);
    }
    return {};
  }

  /// A posture near a joint limit is often near, but the next straight line may start there.
  void prefer_room_to_move(std::vector<JointVector>& postures) const {
    const auto cost = [this](const JointVector& q) {
      double room = kRoom_rad;
      for (std::size_t i = 0; i < kinematics_.limits().joints; ++i) {
        room = std::min({room, q[i] - kinematics_.limits().lower[i], kinematics_.limits().upper[i] - q[i]});
      }
      return joint_distance(q, start_) + kLackOfRoom * (kRoom_rad - room);
    };
    std::stable_sort(postures.begin(), postures.end(),
                     [&](const JointVector& a, const JointVector& b) { return cost(a) < cost(b); });
  }

  /// Back along the tool's own axis: a hand that leaves sideways what it has just pressed would scrape along
  /// it.
  JointPath withdraw(const IsFree& is_free) const {
    Pose back = kinematics_.world_from_tool(start_);
    back.position -= kWithdraw_m * (back.rotation * Eigen::Vector3d::UnitZ());
    JointPath path = straight_tool_path(kinematics_, start_, back);
    for (std::size_t i = 1; i < path.size(); ++i) {
      if (!segment_is_free(path[i - 1], path[i], is_free, kLinearCheck_rad)) return {start_};
    }
    return path.empty() ? JointPath{start_} : path;
  }

  bool can_go_on(JointVector q) const {
    for (const auto& pose : request_.then) {
      const JointPath path = straight_tool_path(kinematics_, q, pose);
      if (path.empty()) return false;
      q = path.back();
    }
    return true;
  }

  /// Free postures, clearly different from each other, the best first; those that cannot go on only if no
  /// other exists.
  std::vector<JointVector> choose_goals(const std::vector<JointVector>& postures,
                                        CollisionChecker& checker) const {
    std::vector<JointVector> good, other;
    for (const auto& q : postures) {
      if (good.size() == kMostGoals || other.size() == kMostDeadEnds) break;
      const auto is_near = [&](const JointVector& known) {
        return joint_distance(q, known) < kGoalsApart_rad;
      };
      if (std::any_of(good.begin(), good.end(), is_near) || std::any_of(other.begin(), other.end(), is_near))
        continue;
      if (checker.is_free(q)) (can_go_on(q) ? good : other).push_back(q);
    }
    if (!good.empty()) return good;
    other.resize(std::min(other.size(), kMostGoals));
    return other;
  }

  MotionResult planned(JointPath& path) const {
    auto postures = kinematics_.solve_all(request_.world_from_tool, start_);
    prefer_room_to_move(postures);
    if (postures.empty()) {
      return failed(MotionFailure::unreachable, goal_text() + " is out of the arm's reach or joint limits");
    }
    if (request_.ignore_collisions) {
      path = {start_, postures.front()};
      return {};
    }
    CollisionChecker checker(world_);
    const IsFree is_free = [&](const JointVector& q) { return checker.is_free(q); };
    const JointPath retreat = checker.touches_at_start() ? withdraw(is_free) : JointPath{start_};
    if (retreat.size() > 1) checker.forget_start();
    const std::vector<JointVector> goals = choose_goals(postures, checker);
    if (goals.empty()) {
      return failed(
          MotionFailure::in_collision,
          goal_text() + " collides in every posture, in the nearest: " + checker.describe(postures.front()));
    }
    PlanLimits search;
    search.seed = request_.seed;
    search.time_limit_s = request_.time_limit_s;
    Plan plan = plan_joint_path(retreat.back(), goals, kinematics_.limits(), is_free, search, stop_);
    switch (plan.outcome) {
      case PlanOutcome::solved:
        path = retreat;
        path.insert(path.end(), plan.path.begin() + 1, plan.path.end());
        return {};
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

  MotionResult follow(const JointPath& path, const FrameSink& sink) const {
    Run run(world_, sink, stop_);
    const double openness = world_.openness_target();
    for (const auto& target : timed_targets(path, world_.task().robot().limits)) {
      if (!run.advance(target, openness)) return ended(run);
    }
    // No longer than until the arm counts as still: a gripper move that comes next then belongs to this stop.
    for (int i = 0; i < kSettleFrames && !still(world_.frame()); ++i) {
      if (!run.advance(path.back(), openness)) return ended(run);
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
