// The part of an Overlay that is painted into a finished picture: points as discs, labels as text.
#pragma once

#include "render/observation.h"
#include "render/overlay.h"

namespace flowscope {

/// Opacity of what lies behind a surface, relative to what lies in front: hidden, yet never lost.
inline constexpr float hidden_opacity = 0.35f;
/// Two surfaces nearer than this are one, metres.
inline constexpr float depth_tolerance_m = 0.004f;

/// `view.depth` decides which points are hidden. Discs are round and as large as the point would be in space.
void paint_points(const Overlay& overlay, View& view);
/// Outlined text beside each position that is in front of the camera. Characters other than ASCII become '?'.
void paint_labels(const Overlay& overlay, View& view);

}  // namespace flowscope
