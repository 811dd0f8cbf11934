// Mixing a colour into a pixel. Internal to the painters of overlays.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "render/overlay.h"

namespace flowscope {

/// The colour's own opacity does not count: `opacity` does.
inline void mix(std::uint8_t* pixel, const Rgba& color, double opacity) {
  for (std::size_t c = 0; c < 3; ++c) {
    const double ink = 255.0 * std::clamp(color[c], 0.0f, 1.0f);
    pixel[c] = static_cast<std::uint8_t>(std::lround(pixel[c] + (ink - pixel[c]) * opacity));
  }
}

}  // namespace flowscope
