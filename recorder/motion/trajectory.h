// From a path to timed joint targets, one per recorded frame.
#pragma once

#include "recorder/motion/planner.h"

namespace flowscope {

/// Joint targets at 20 Hz along `path`: starts from rest, ends at rest exactly at its last corner, as fast as
/// the limits allow. Corners are cut by at most `corner_rad` (rounded_path.h), so that passing them is no
/// stop; 0 stops at each. The present posture, path.front(), is not among the targets.
JointPath timed_targets(const JointPath& path, const MotionLimits& limits = {}, double corner_rad = 0.05);

/// Whether a line may pass close by a singularity, where joints turn far while the tool hardly moves:
/// possible, but slow, and slow to find.
enum class LineEffort { quick, thorough };

/// The joint path that leads the tool along a straight line (and the shortest turn) from its pose at `start`
/// to `world_from_tool`, on one branch of the inverse kinematics: no joint ever jumps. Empty when no such
/// path exists; then `reached` (0 to 1), if given, says how much of the line was possible. Of several such
/// paths the first that `accept` likes, if given, else the first; by a singularity only if there is none
/// elsewhere.
JointPath straight_tool_path(const Kinematics& kinematics, const JointVector& start,
                             const Pose& world_from_tool, double* reached = nullptr,
                             const std::function<bool(const JointPath&)>& accept = {},
                             LineEffort effort = LineEffort::thorough);

}  // namespace flowscope
