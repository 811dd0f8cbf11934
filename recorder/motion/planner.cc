#include "recorder/motion/planner.h"

#include <ompl/base/StateSampler.h>
#include <ompl/base/goals/GoalStates.h>
#include <ompl/base/spaces/RealVectorStateSpace.h>
#include <ompl/datastructures/NearestNeighborsLinear.h>
#include <ompl/geometric/SimpleSetup.h>
#include <ompl/geometric/planners/rrt/RRTConnect.h>
#include <ompl/util/Console.h>

#include <chrono>
#include <cmath>
#include <exception>
#include <random>

namespace flowscope {
namespace {

namespace ob = ompl::base;
namespace og = ompl::geometric;
using RealState = ob::RealVectorStateSpace::StateType;

constexpr double kSearchResolution_rad = 0.04;
constexpr double kShortcutResolution_rad = 0.01;
constexpr double kFinalResolution_rad = 0.0025;
constexpr int kAttempts = 3;  ///< a path that fails the finer check is searched anew, with other numbers
constexpr int kShortcuts = 60;

/// Uniform in [0, 1) from the generator's own bits: std distributions differ between libraries.
double uniform(std::mt19937_64& random) { return double(random() >> 11) * 0x1.0p-53; }

JointVector joints_of(const ob::State* state, std::size_t joints) {
  JointVector q{};
  for (std::size_t i = 0; i < joints; ++i) q[i] = state->as<RealState>()->values[i];
  return q;
}

/// OMPL seeds its own samplers once per program; planning must depend on the query's seed alone.
class SeededSampler : public ob::StateSampler {
 public:
  SeededSampler(const ob::StateSpace* space, std::mt19937_64& random)
      : ob::StateSampler(space), random_(random) {}
  void sampleUniform(ob::State* state) override {
    const auto& bounds = space_->as<ob::RealVectorStateSpace>()->getBounds();
    for (unsigned i = 0; i < bounds.low.size(); ++i) {
      state->as<RealState>()->values[i] = std::lerp(bounds.low[i], bounds.high[i], uniform(random_));
    }
  }
  void sampleUniformNear(ob::State* state, const ob::State* near, double distance) override {
    const auto& bounds = space_->as<ob::RealVectorStateSpace>()->getBounds();
    for (unsigned i = 0; i < bounds.low.size(); ++i) {
      const double center = near->as<RealState>()->values[i];
      const double low = std::max(bounds.low[i], center - distance);
      const double high = std::min(bounds.high[i], center + distance);
      state->as<RealState>()->values[i] = std::lerp(low, high, uniform(random_));
    }
  }
  void sampleGaussian(ob::State* state, const ob::State* mean, double deviation) override {
    sampleUniformNear(state, mean, 2 * deviation);  // RRTConnect never asks for it
  }

 private:
  std::mt19937_64& random_;
};

/// What the validity checks of one query throw must not unwind through OMPL: kept here and thrown again
/// afterwards.
class GuardedCheck {
 public:
  explicit GuardedCheck(const IsFree& is_free) : is_free_(is_free) {}
  bool operator()(const JointVector& q) {
    if (error_) return false;
    try {
      return is_free_(q);
    } catch (...) {
      error_ = std::current_exception();
      return false;
    }
  }
  bool failed() const { return error_ != nullptr; }
  void rethrow() const {
    if (error_) std::rethrow_exception(error_);
  }

 private:
  const IsFree& is_free_;
  std::exception_ptr error_;
};

/// Replaces stretches between two random places of the path by straight lines where these are free.
void shorten(JointPath& path, const IsFree& is_free, std::mt19937_64& random) {
  for (int i = 0; i < kShortcuts && path.size() > 2; ++i) {
    const auto place = [&] {
      const double at = uniform(random) * double(path.size() - 1);
      const auto corner = std::min(static_cast<std::size_t>(at), path.size() - 2);
      return std::pair{corner, joints_between(path[corner], path[corner + 1], at - double(corner))};
    };
    auto from = place(), to = place();
    if (from.first > to.first) std::swap(from, to);
    if (from.first == to.first) continue;
    if (!segment_is_free(from.second, to.second, is_free, kShortcutResolution_rad)) continue;
    JointPath shorter(path.begin(), path.begin() + static_cast<std::ptrdiff_t>(from.first) + 1);
    shorter.push_back(from.second);
    shorter.push_back(to.second);
    shorter.insert(shorter.end(), path.begin() + static_cast<std::ptrdiff_t>(to.first) + 1, path.end());
    path = std::move(shorter);
  }
}

/// Leaves out corners that the straight line past them does not need: what random places leave behind.
void drop_corners(JointPath& path, const IsFree& is_free) {
  for (std::size_t i = 1; i + 1 < path.size();) {
    if (segment_is_free(path[i - 1], path[i + 1], is_free, kShortcutResolution_rad)) {
      path.erase(path.begin() + static_cast<std::ptrdiff_t>(i));
    } else {
      ++i;
    }
  }
}

class Search {
 public:
  Search(const JointVector& start, const std::vector<JointVector>& goals, const JointLimits& limits,
         GuardedCheck& check, const PlanLimits& search, std::stop_token stop)
      : start_(start),
        goals_(goals),
        limits_(limits),
        check_(check),
        left_(search.iterations),
        deadline_(std::chrono::steady_clock::now() +
                  std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                      std::chrono::duration<double>(search.time_limit_s))),
        stop_(std::move(stop)),
        random_(search.seed) {}

  Plan run() {
    ompl::msg::setLogLevel(ompl::msg::LOG_NONE);
    const IsFree is_free = [this](const JointVector& q) { return check_(q); };
    for (int attempt = 0; attempt < kAttempts && !over(); ++attempt) {
      const JointPath found = grow();
      if (found.empty()) break;
      if (!path_is_free(found, is_free, kFinalResolution_rad)) continue;
      JointPath path = found;
      shorten(path, is_free, random_);
      drop_corners(path, is_free);
      return {PlanOutcome::solved, path_is_free(path, is_free, kFinalResolution_rad) ? path : found};
    }
    return {outcome_, {}};
  }

 private:
  bool over() {
    if (stop_.stop_requested()) outcome_ = PlanOutcome::cancelled;
    if (outcome_ == PlanOutcome::no_path && std::chrono::steady_clock::now() > deadline_) {
      outcome_ = PlanOutcome::timed_out;
    }
    return left_ <= 0 || outcome_ != PlanOutcome::no_path || check_.failed();
  }

  JointPath grow() {
    const auto joints = static_cast<unsigned>(limits_.joints);
    auto space = std::make_shared<ob::RealVectorStateSpace>(joints);
    ob::RealVectorBounds bounds(joints);
    for (unsigned i = 0; i < joints; ++i) {
      // A simulated joint may rest a hair beyond its limit.
      bounds.setLow(i, std::min(limits_.lower[i], start_[i]));
      bounds.setHigh(i, std::max(limits_.upper[i], start_[i]));
    }
    space->setBounds(bounds);
    space->setStateSamplerAllocator(
        [this](const ob::StateSpace* s) { return std::make_shared<SeededSampler>(s, random_); });
    space->setLongestValidSegmentFraction(kSearchResolution_rad / space->getMaximumExtent());

    og::SimpleSetup setup(space);
    setup.setStateValidityChecker(
        [this](const ob::State* state) { return check_(joints_of(state, limits_.joints)); });
    ob::ScopedState<ob::RealVectorStateSpace> start(space);
    for (unsigned i = 0; i < joints; ++i) start[i] = start_[i];
    setup.setStartState(start);
    auto goal_states = std::make_shared<ob::GoalStates>(setup.getSpaceInformation());
    for (const auto& q : goals_) {
      ob::ScopedState<ob::RealVectorStateSpace> goal(space);
      for (unsigned i = 0; i < joints; ++i) goal[i] = q[i];
      goal_states->addState(goal);
    }
    setup.setGoal(goal_states);
    auto planner = std::make_shared<og::RRTConnect>(setup.getSpaceInformation());
    planner->setRange(0.8);
    planner->setNearestNeighbors<ompl::NearestNeighborsLinear>();  // the default one draws random numbers of
                                                                   // its own
    setup.setPlanner(planner);

    const ob::PlannerTerminationCondition ends([this] { return --left_, over(); });
    if (setup.solve(ends) != ob::PlannerStatus::EXACT_SOLUTION) return {};
    JointPath path;
    for (const auto* state : setup.getSolutionPath().getStates()) path.push_back(joints_of(state, joints));
    return path;
  }

  const JointVector start_;
  const std::vector<JointVector>& goals_;
  const JointLimits& limits_;
  GuardedCheck& check_;
  int left_;
  std::chrono::steady_clock::time_point deadline_;
  std::stop_token stop_;
  std::mt19937_64 random_;
  PlanOutcome outcome_ = PlanOutcome::no_path;
};

}  // namespace

JointVector joints_between(const JointVector& from, const JointVector& to, double share) {
  JointVector q;
  for (std::size_t i = 0; i < q.size(); ++i) q[i] = from[i] + share * (to[i] - from[i]);
  return q;
}

bool segment_is_free(const JointVector& from, const JointVector& to, const IsFree& is_free,
                     double resolution_rad) {
  const int steps = std::max(1, static_cast<int>(std::ceil(joint_distance(from, to) / resolution_rad)));
  // Coarse first: where something is in the way, it is met soon.
  int stride = 1;
  while (2 * stride <= steps) stride *= 2;
  for (; stride >= 1; stride /= 2) {
    for (int i = stride; i <= steps; i += 2 * stride) {
      if (!is_free(joints_between(from, to, double(i) / steps))) return false;
    }
  }
  return true;
}

bool path_is_free(const JointPath& path, const IsFree& is_free, double resolution_rad) {
  for (std::size_t i = 1; i < path.size(); ++i) {
    if (!segment_is_free(path[i - 1], path[i], is_free, resolution_rad)) return false;
  }
  return true;
}

Plan plan_joint_path(const JointVector& start, const std::vector<JointVector>& goals,
                     const JointLimits& limits, const IsFree& is_free, const PlanLimits& search,
                     std::stop_token stop) {
  GuardedCheck check(is_free);
  const IsFree guarded = [&check](const JointVector& q) { return check(q); };
  Plan plan;
  for (const auto& goal : goals) {
    if (stop.stop_requested()) return {PlanOutcome::cancelled, {}};
    if (segment_is_free(start, goal, guarded, kFinalResolution_rad)) {
      plan = {PlanOutcome::solved, {start, goal}};
      break;
    }
  }
  if (plan.path.empty() && !goals.empty()) plan = Search(start, goals, limits, check, search, stop).run();
  check.rethrow();
  return plan;
}

}  // namespace flowscope
