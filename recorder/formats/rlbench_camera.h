// RLBench's conventions for cameras and depth, converted at this one door.
#pragma once

#include "render/observation.h"

namespace flowscope {

/// RLBench's camera frame has x left, y up, z forward, so its focal lengths are negative, and it calls the
/// centre of the first pixel 0 where we say 0.5: with the principal point moved by that half pixel, its own
/// point cloud function gives our points exactly.
Eigen::Matrix3d rlbench_intrinsics(const CameraModel& camera);

/// world_from_camera, 4x4, in that camera frame. Metres.
Eigen::Matrix4d rlbench_extrinsics(const CameraModel& camera);

/// Depth as 24-bit whole numbers in RGB, R highest: (depth - near) / (far - near) * (2^24 - 1), rounded.
/// Where nothing was hit all bits are set; what was hit never has all of them.
ImageRgb pack_rlbench_depth(const DepthImage& depth, const CameraModel& camera);

/// The inverse, within (far - near) / 2^25.
DepthImage unpack_rlbench_depth(const ImageRgb& packed, const CameraModel& camera);

}  // namespace flowscope
