// A collision-free path through joint space: OMPL's RRTConnect behind one function.
#pragma once

#include <cstdint>
#include <functional>
#include <stop_token>
#include <vector>

#include "recorder/motion/kinematics.h"

namespace flowscope {

using JointPath = std::vector<JointVector>;  ///< corners; straight lines in joint space between them
using IsFree = std::function<bool(const JointVector&)>;

struct PlanLimits {
  std::uint64_t seed = 0;
  int iterations = 20'000;  ///< what ends a hopeless search: the same on every machine
  /// Wall clock, a guard only: a search that it ends fails, it never finds another path.
  double time_limit_s = 30;
};

enum class PlanOutcome { solved, no_path, timed_out, cancelled };

struct Plan {
  PlanOutcome outcome = PlanOutcome::no_path;
  JointPath path;  ///< starts at `start`, ends at one of the goals, free at 0.0025 rad resolution
};

/// `goals` in order of preference, each free. A straight line to one of them is taken when it is free; else
/// two trees are grown, the path found is shortened, and it is checked again at
/// 16 times finer resolution than the search's. The result depends on the arguments only, never on time or on
/// earlier calls. Whatever `is_free` throws comes out here.
Plan plan_joint_path(const JointVector& start, const std::vector<JointVector>& goals,
                     const JointLimits& limits, const IsFree& is_free, const PlanLimits& search,
                     std::stop_token stop = {});

/// The posture at `share` (0 to 1) of the way.
JointVector joints_between(const JointVector& from, const JointVector& to, double share);

/// Whether the straight line between both is free (`from` is not asked), looked at every `resolution_rad` of
/// the joint that moves most.
bool segment_is_free(const JointVector& from, const JointVector& to, const IsFree& is_free,
                     double resolution_rad);
bool path_is_free(const JointPath& path, const IsFree& is_free, double resolution_rad);

}  // namespace flowscope
