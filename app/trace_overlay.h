// One step of a flow trace as things to draw.
#pragma once

#include "policy/flow_trace.h"
#include "render/overlay.h"

namespace flowscope {

/// Sphere, the points inside it, the trajectory so far (solid) and to come (faint) from violet noise to amber
/// action, the gripper's ghost at the step, and the expert's in green where known. `step` is clamped to the
/// trace.
Overlay overlay_of(const FlowTrace& trace, int step);

}  // namespace flowscope
