// Actions from frame to frame, in the forms that robomimic's tools know.
#pragma once

#include <vector>

#include "recorder/demo.h"

namespace flowscope {

/// One unit of a relative action, as in an operational-space controller: the arm stays far below both in one
/// frame of 0.05 s.
inline constexpr double action_position_m = 0.1, action_rotation_rad = 0.5;

/// From frame t to frame t + 1. World frame.
struct FrameAction {
  Pose target;                      ///< world_from_tool at t + 1
  Eigen::Vector3d rotation_vector;  ///< of `target`, rad; of all equal ones the nearest to the action before
  Eigen::Vector3d position_step, rotation_step;  ///< in units of the above, in [-1, 1]
  double gripper = -1;                           ///< -1 opens, 1 closes (robosuite's signs)
  bool clipped = false;                          ///< the true step was larger than 1
};

/// One less than there are frames.
std::vector<FrameAction> frame_actions(const std::vector<Frame>& frames);

}  // namespace flowscope
