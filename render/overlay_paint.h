// An Overlay painted into a finished picture. `view.depth` is the scene's own and decides what is hidden;
// what is hidden is painted faintly instead of left out, so that a trajectory inside an object stays visible.
#pragma once

#include "render/observation.h"
#include "render/overlay.h"

namespace flowscope {

/// Opacity of what lies behind a surface, relative to what lies in front.
inline constexpr float hidden_opacity = 0.35f;
/// Two surfaces nearer than this are one, metres.
inline constexpr float depth_tolerance_m = 0.004f;

/// See-through, ray by ray: surfaces inside a sphere are tinted most, the line where it cuts them is drawn.
void paint_spheres(const Overlay& overlay, View& view);
/// See-through, ray by ray, with the edges of all faces and the line where the box cuts a surface.
void paint_boxes(const Overlay& overlay, View& view);
/// Round discs as large as the points would be in space.
void paint_points(const Overlay& overlay, View& view);
/// A picture of solids alone, of the view's size; its depth is 0 where there is none.
void paint_layer(const View& layer, float opacity, View& view);
/// Outlined text beside each position that is in front of the camera. Characters other than ASCII become '?'.
void paint_labels(const Overlay& overlay, View& view);

}  // namespace flowscope
