// Which moments of a session that was moved by hand are keyframes.
#pragma once

#include <vector>

#include "recorder/demo.h"

namespace flowscope {

inline constexpr double hand_rest_s = 1;  ///< a hand that lets go for less is on its way
inline constexpr double hand_same_m = 0.005, hand_same_rad = 0.05;

/// Indices of frames, ascending. A hand creeps, taps and thinks, so that the benchmark's rule (keyframes.h)
/// finds a stop nearly everywhere. Of what was moved by hand these are keyframes: every change of the
/// gripper, every rest of at least a second, where a script took over, and the end. Rests and ends within 5
/// mm and 0.05 rad (3 degrees) of the keyframe before or of the change that follows are the same stop: the
/// later moment stands for both. Between movements by hand the benchmark's rule holds.
///   `by_hand`: for each frame, whether a hand moved to it. `rests`: the frames, ascending, at which it then
///   let go for hand_rest_s or longer.
std::vector<int> hand_keyframes(const std::vector<Frame>& frames, const std::vector<char>& by_hand,
                                const std::vector<int>& rests);

}  // namespace flowscope
