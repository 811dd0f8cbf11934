// One step of a flow trace as things to draw.
#pragma once

#include <vector>

#include "policy/flow_trace.h"
#include "render/overlay.h"

namespace flowscope {

/// Sphere, the points inside it, the trajectory so far (solid) and to come (faint) from violet noise to amber
/// action, the gripper's ghost at the step, and the expert's in green where known. `step` is clamped to the
/// trace.
Overlay overlay_of(const FlowTrace& trace, int step);

/// Several predictions of one scene from different noises, as papers show actions that have more than one
/// right answer: every flow from violet to amber, a ghost where each ends, the expert's in green where known.
Overlay overlay_of_samples(const std::vector<FlowTrace>& samples);

}  // namespace flowscope
