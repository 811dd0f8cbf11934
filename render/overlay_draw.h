// An Overlay's solid part as MuJoCo geoms: lines, frames and ghosts. The rest is painted (overlay_paint.h).
#pragma once

#include <mujoco/mujoco.h>

#include "render/gripper_shape.h"
#include "render/overlay.h"

namespace flowscope {

/// Room that the scene for solids needs. Longer polylines are thinned to fit.
inline constexpr int overlay_geom_limit = 8000;

/// A geom's opacity stays in its rgba. Ghosts look like `gripper`.
void append_solids(const Overlay& overlay, const GripperShape& gripper, mjvScene& scene);
/// Replaces the scene's lights by the one under which solids have the colours that the overlay names.
void light_solids(mjvScene& scene);

}  // namespace flowscope
