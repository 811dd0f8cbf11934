// How long one recorded frame lasts.
#pragma once

namespace flowscope {

inline constexpr double frame_s = 0.05;  ///< the benchmark's 20 Hz

}  // namespace flowscope
