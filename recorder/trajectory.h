// From a path to timed joint targets, one per recorded frame.
#pragma once

#include "recorder/planner.h"

namespace flowscope {

/// Joint targets at 20 Hz along `path`: starts from rest, ends at rest exactly at its last corner, and never
/// slows down in between (so that nothing but its end looks like a stop). The present posture, path.front(),
/// is not among them.
JointPath timed_targets(const JointPath& path, const MotionLimits& limits = {});

/// The joint path that leads the tool along a straight line (and the shortest turn) from its pose at `start`
/// to `world_from_tool`, on one branch of the inverse kinematics: no joint ever jumps. Empty when no such
/// path exists; then `reached` (0 to 1), if given, says how much of the line was possible.
JointPath straight_tool_path(const Kinematics& kinematics, const JointVector& start,
                             const Pose& world_from_tool, double* reached = nullptr);

}  // namespace flowscope
