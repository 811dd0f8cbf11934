#include "recorder/motion/move_plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>

#include "recorder/frame_time.h"
#include "recorder/motion/goal_choice.h"
#include "recorder/motion/trajectory.h"
#include "recorder/world.h"

namespace flowscope {
namespace {

constexpr int kSweep = 32;  ///< values of a Panda's seventh joint, where nothing needs to be free
constexpr std::array kWithdraw_m{0.03, 0.06, 0.10};  ///< as far as it must
constexpr double kLinearCheck_rad = 0.01;
constexpr double kExecutedCheck_rad = 0.0025;  ///< of what is commanded: finer than any search
constexpr double kUncheckedLook_rad = 0.04;    ///< of motions without collision checks: the arm's links
/// How far corners may be cut, the roundest first; at none the arm would stop at each.
constexpr std::array kCorners_rad{0.3, 0.1, 0.03, 0.01, 0.003, 0.001, 0.0003, 0.0};
constexpr double kSlow_rad_s = 0.2;  ///< clearly faster than what the keyframe rule takes for a stop
constexpr int kSearches = 4;         ///< for a path on which the arm need not stop
constexpr std::uint64_t kSearchSeeds = 0x9e3779b97f4a7c15;

template <typename... Args>
std::string text(const char* format, Args... args) {
  char buffer[256];
  std::snprintf(buffer, sizeof buffer, format, args...);
  return buffer;
}

std::string place_of(const Pose& pose) {
  return text("(%.3f, %.3f, %.3f) m", pose.position.x(), pose.position.y(), pose.position.z());
}

MotionResult failed(MotionFailure failure, std::string message) {
  return {failure, std::move(message), std::nullopt};
}

class MovePlanner {
 public:
  MovePlanner(const World& world, const MoveRequest& request, std::stop_token stop)
      : world_(world),
        request_(request),
        stop_(std::move(stop)),
        kinematics_(Kinematics::from_model(world.model(), world.task().robot())),
        ahead_(kinematics_, request.then),
        start_(world.frame().q) {}

  PlannedMove plan() {
    PlannedMove move;
    move.result = request_.linear ? straight(move.targets) : planned(move.targets);
    return move;
  }

 private:
  std::string goal_text() const { return "the tool pose at " + place_of(request_.world_from_tool); }

  MotionResult out_of_reach() const {
    return failed(MotionFailure::unreachable, goal_text() + " is out of the arm's reach or joint limits");
  }

  MotionResult straight(JointPath& targets) const {
    CollisionChecker checker(world_);
    const IsFree is_free = [&](const JointVector& q) {
      if (request_.ignore_collisions) return checker.links_are_free(q);
      return request_.may_push ? checker.is_free_to_push(q) : checker.is_free(q);
    };
    const auto accept = [&](const JointPath& path) { return path_is_free(path, is_free, kLinearCheck_rad); };
    double reached = 0;
    JointPath path = line_that_leads_on(accept, checker);
    if (path.empty())
      path = straight_tool_path(kinematics_, start_, request_.world_from_tool, &reached, accept);
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

  /// A free straight line that does not end where the lines that follow are impossible: a line can be
  /// followed in as many ways as there are values of the seventh joint at its end. Empty where there is none,
  /// or nothing follows.
  JointPath line_that_leads_on(const std::function<bool(const JointPath&)>& is_free,
                               CollisionChecker& checker) const {
    if (ahead_.nothing_follows()) return {};
    bool leads_on = false;
    JointPath path = straight_tool_path(
        kinematics_, start_, request_.world_from_tool, nullptr, [&](const JointPath& line) {
          return leads_on = is_free(line) && ahead_.from(line.back(), checker) != Onward::no;
        });
    return leads_on ? path : JointPath{};
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

  /// Back along the tool's own axis until nothing touches: a hand that leaves sideways what it has just
  /// pressed would scrape along it, and a search has no room beside what it touches.
  JointPath withdraw(CollisionChecker& checker, const IsFree& is_free) const {
    JointPath way{start_};
    for (const double length_m : kWithdraw_m) {
      if (!checker.touches(way.back())) break;
      Pose back = kinematics_.world_from_tool(start_);
      back.position -= length_m * (back.rotation * Eigen::Vector3d::UnitZ());
      const JointPath path = straight_tool_path(kinematics_, start_, back, nullptr, {}, LineEffort::quick);
      if (path.empty() || !path_is_free(path, is_free, kLinearCheck_rad)) break;
      // So short a line is straight in joint space too; fewer corners are rounder ones.
      const JointPath direct{start_, path.back()};
      way = path_is_free(direct, is_free, kLinearCheck_rad) ? direct : path;
    }
    return way;
  }

  /// Straight through joint space to a posture for which the arm's links touch nothing on the way, if there
  /// is one; the hand may touch anything.
  JointPath unchecked(const std::vector<JointVector>& postures) const {
    CollisionChecker checker(world_);
    const auto is_free = [&](const JointVector& q) { return checker.links_are_free(q); };
    const auto best = std::ranges::find_if(postures, [&](const JointVector& q) {
      return segment_is_free(start_, q, is_free, kUncheckedLook_rad);
    });
    return {start_, best != postures.end() ? *best : postures.front()};
  }

  MotionResult planned(JointPath& targets) const {
    if (request_.ignore_collisions) {
      const auto postures = kinematics_.solve_all(request_.world_from_tool, start_, kSweep);
      if (postures.empty()) return out_of_reach();
      targets = timed_targets(unchecked(postures), world_.task().robot().limits);
      return {};
    }
    Commanded best;
    if (CollisionChecker(world_).carries()) search_several(Care::carried_apart, best);
    if (best.fit != Fit::smooth) search_several(Care::nothing_touches, best);
    targets = std::move(best.targets);
    return best.result;
  }

  /// What is asked of a path: that nothing touches, or besides that what the hand carries stays apart.
  enum class Care { nothing_touches, carried_apart };
  enum class Fit { none, too_narrow, with_stops, smooth };
  /// One path, as it would be commanded.
  struct Commanded {
    MotionResult result;
    JointPath targets;
    Fit fit = Fit::none;
  };
  static Commanded no_path(MotionFailure failure, std::string message) {
    return {failed(failure, std::move(message)), {}};
  }

  /// Whether the arm nearly rests between two faster stretches: at a corner without room, or where the path
  /// turns back.
  bool stops_on_the_way(const JointPath& targets) const {
    bool was_fast = false, slowed = false;
    JointVector from = start_;
    for (const auto& to : targets) {
      const bool fast = joint_distance(from, to) > kSlow_rad_s * frame_s;
      if (fast && slowed) return true;
      slowed = was_fast && !fast;
      was_fast = was_fast || fast;
      from = to;
    }
    return false;
  }

  void search_several(Care care, Commanded& best) const {
    for (int search = 0; search < kSearches; ++search) {
      Commanded found = searched(search, care);
      const bool none = found.fit == Fit::none;
      if (best.fit == Fit::none || found.fit > best.fit) best = std::move(found);
      if (none || best.fit == Fit::smooth) break;
    }
  }

  static bool is_free(CollisionChecker& checker, Care care, const JointVector& q,
                      double depth_m = CollisionChecker::clear_depth_m) {
    return care == Care::carried_apart ? checker.carries_clear(q) : checker.is_clear(q, depth_m);
  }

  /// Every search but the first keeps clear of things, so that the next path lies where corners have room.
  Commanded searched(int search, Care care) const {
    CollisionChecker checker(world_);
    const IsFree is_free = [&](const JointVector& q) {
      return MovePlanner::is_free(checker, care, q, search == 0 ? CollisionChecker::clear_depth_m : 0);
    };
    const JointPath retreat = withdraw(checker, is_free);
    if (retreat.size() > 1) checker.start_from(retreat.back());
    const Goals goals = choose_goals(kinematics_, request_.world_from_tool, start_, ahead_, is_free, checker);
    if (!goals.nearest) return {out_of_reach(), {}};
    if (goals.postures.empty()) {
      return no_path(
          MotionFailure::in_collision,
          goal_text() + " collides in every posture, in the nearest: " + checker.describe(*goals.nearest));
    }
    if (request_.must_lead_on && goals.onward == Onward::no) {
      return no_path(MotionFailure::unreachable,
                     "from " + goal_text() +
                         " the straight lines that follow are out of the arm's reach or joint limits");
    }
    PlanLimits limits;
    limits.seed = request_.seed + kSearchSeeds * static_cast<std::uint64_t>(search);
    limits.time_limit_s = request_.time_limit_s;
    const Plan plan =
        plan_joint_path(retreat.back(), goals.postures, kinematics_.limits(), is_free, limits, stop_);
    const std::string none = "no collision-free path to " + goal_text();
    switch (plan.outcome) {
      case PlanOutcome::solved:
        return timed(retreat, plan.path, care);
      case PlanOutcome::cancelled:
        return no_path(MotionFailure::cancelled, "cancelled while planning");
      case PlanOutcome::timed_out:
        return no_path(MotionFailure::timed_out, none + text(" within %.1f s", limits.time_limit_s));
      case PlanOutcome::no_path:
        break;
    }
    return no_path(MotionFailure::timed_out, none + text(" within %d tries", limits.iterations));
  }

  /// With corners as round as the room around them allows. A retreat begins where things touch that may, so
  /// what is commanded is checked against the start as it is.
  Commanded timed(JointPath path, const JointPath& plan, Care care) const {
    path.insert(path.end(), plan.begin() + 1, plan.end());
    CollisionChecker checker(world_);
    const IsFree is_free = [&](const JointVector& q) { return MovePlanner::is_free(checker, care, q); };
    Commanded found;
    std::optional<JointVector> hit;
    for (const double corner_rad : kCorners_rad) {
      found.targets = timed_targets(path, world_.task().robot().limits, corner_rad);
      hit = first_collision(found.targets, is_free);
      if (hit) continue;
      found.fit = stops_on_the_way(found.targets) ? Fit::with_stops : Fit::smooth;
      return found;
    }
    found =
        no_path(MotionFailure::in_collision,
                "the path to " + goal_text() + " is too narrow to be followed: " + checker.describe(*hit));
    found.fit = Fit::too_narrow;
    return found;
  }

  const World& world_;
  const MoveRequest& request_;
  std::stop_token stop_;
  Kinematics kinematics_;
  LookAhead ahead_;
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

MotionResult no_robot() {
  return failed(MotionFailure::unreachable,
                "the scene is open for viewing: nothing says which robot is in it");
}

PlannedMove plan_move(const World& world, const MoveRequest& request, std::stop_token stop) {
  if (world.task().robot().joints.empty()) return {no_robot(), {}};
  PlannedMove move = MovePlanner(world, request, std::move(stop)).plan();
  // Whoever cancelled knows that it did not get there.
  if (!move.result && move.result.failure != MotionFailure::cancelled)
    move.result.world_from_tool = request.world_from_tool;
  return move;
}

}  // namespace flowscope
