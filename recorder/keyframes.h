// The benchmark's keyframe rule.
#pragma once

#include <vector>

#include "recorder/demo.h"

namespace flowscope {

/// Indices of the keyframes of a run recorded at 20 Hz: where the arm stands still (every |dq| <= 0.1 rad/s)
/// with an unchanged gripper, where the gripper changes, and the last frame; the second-to-last goes when the
/// last two are neighbours. Frame 0 is never one. After peract/peract helpers/demo_loading_utils.py, with
/// indices clamped at 0.
std::vector<int> find_keyframes(const std::vector<Frame>& frames);

/// The same, less those that only repeat the action before them, from which there is nothing to learn: the
/// one before the last frame when something fell into place after the hand had let go, and those where the
/// arm waited for a slow gripper.
std::vector<int> keyframes_to_learn(const std::vector<Frame>& frames);

}  // namespace flowscope
