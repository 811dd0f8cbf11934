// A move that failed as things to draw: where the tool was to go, and why it is not there.
#pragma once

#include <string>

#include "render/overlay.h"

namespace flowscope {

/// The gripper's ghost in red, its frame, and the reason as a label of short lines beside it.
Overlay overlay_of_failure(const Pose& world_from_tool, const std::string& reason);

}  // namespace flowscope
