// From a wanted tool pose to a simulated motion: planned (move_plan.h) and followed.
#pragma once

#include <functional>
#include <stop_token>

#include "recorder/motion/move_plan.h"
#include "recorder/world.h"

namespace flowscope {

/// Called after every 20 Hz frame of any motion; return false to stop early (success reached, viewer
/// cancelled).
using FrameSink = std::function<bool(const Frame&)>;

/// Plans (plan_move) and follows. Stops moving as soon as `sink` returns false (that is not a failure).
MotionResult move_to(World& world, const MoveRequest& request, const FrameSink& sink,
                     std::stop_token stop = {});
/// Fingers to `openness`, arm still; grasps after closing, releases before opening. What they were told
/// already changes nothing.
MotionResult move_gripper(World& world, double openness, const FrameSink& sink, std::stop_token stop = {});

}  // namespace flowscope
