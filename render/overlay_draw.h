// An Overlay as MuJoCo geoms: the part of it that is drawn in 3-D. Points and labels are painted afterwards
// (overlay_paint.h).
#pragma once

#include <mujoco/mujoco.h>

#include "render/overlay.h"

namespace flowscope {

/// Room that a scene's geom buffer needs beside the model's own geoms. Longer polylines are thinned to fit.
inline constexpr int overlay_geom_limit = 4000;

/// Lines, frames and ghosts.
void append_solids(const Overlay& overlay, mjvScene& scene);
/// See-through spheres.
void append_spheres(const Overlay& overlay, mjvScene& scene);

}  // namespace flowscope
