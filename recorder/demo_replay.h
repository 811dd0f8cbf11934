// Running a demonstration again, and how far off that leads.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "recorder/demo.h"
#include "recorder/demo_stats.h"
#include "recorder/motion/motion.h"
#include "recorder/world.h"

namespace flowscope {

/// Recorded moments against the replayed ones.
struct Divergence {
  Spread tool_mm, tool_deg;
  Spread joint_rad;    ///< of each moment's worst joint
  Spread object_mm;    ///< of each moment's object that is farthest off; none when nothing can move
  std::string object;  ///< which one that was at the worst moment
};

struct ReplayReport {
  Divergence divergence;
  /// How far the task, as it is now, places an object from where the demonstration begins.
  double start_mm = 0;
  bool success = false;            ///< the task's condition has held; without one: it did not end early
  std::vector<SuccessTerm> terms;  ///< at the end
  int moments = 0;                 ///< frames, or by actions keyframes, that were compared
  std::string failure;             ///< why it ended early; empty when it did not
};

/// Restores every recorded state and judges it: exact, so whatever diverges says that file and scene do not
/// belong together. Throws std::invalid_argument when the states do not fit the task.
ReplayReport replay_states(std::shared_ptr<const Task> task, const Demo& demo);

/// Simulates from the first state on with the joint targets, grips and releases that the states tell of:
/// what diverges is the simulation. Throws like replay_states.
ReplayReport replay_targets(std::shared_ptr<const Task> task, const Demo& demo);

/// Carries out one keyframe's action in a world; `sink` sees the frames.
using CarryOut = std::function<MotionResult(World&, const GripperAction&, const FrameSink& sink)>;

/// From the first state on, carries out the keyframes one after the other until the task succeeds, and
/// compares at each. The ways between them are planned anew. Throws like replay_states.
ReplayReport replay_actions(std::shared_ptr<const Task> task, const Demo& demo, const CarryOut& carry_out);

}  // namespace flowscope
