// The waypoints of a script as things to draw.
#pragma once

#include <optional>
#include <vector>

#include "recorder/script_poses.h"
#include "render/overlay.h"

namespace flowscope {

/// A frame with its number at every move, a line from each to the next (strong where the tool goes straight,
/// faint where the way is planned), and the gripper at step `selected`. Numbers count the moves and gripper
/// steps of the script from 1, as the page's cards do; the first 200 are drawn.
Overlay overlay_of_waypoints(const std::vector<PlacedStep>& steps, std::optional<int> selected);

}  // namespace flowscope
