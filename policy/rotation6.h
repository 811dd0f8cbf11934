// The 9-vector of the flow: normalised position (3) and the first two columns of the rotation (6).
#pragma once

#include "policy/flow_trace.h"

namespace flowscope {

/// First two COLUMNS of the rotation matrix, concatenated.
Eigen::Matrix<double, 6, 1> rotation_to_6d(const Eigen::Quaterniond& rotation);
/// Gram-Schmidt: x = a1 / |a1|, z = x × a2 normalised, y = z × x. Norms are guarded by 1e-8, so any input
/// gives a rotation.
Eigen::Quaterniond rotation_from_6d(const Eigen::Matrix<double, 6, 1>& columns);

/// Maps the box of keyframe positions (widened) to [-1, 1] per axis.
struct PositionScale {
  Eigen::Vector3d center{0, 0, 0}, half{1, 1, 1};  ///< metres, world

  /// `bounds` widened by 4 cm on every side, as the method's ancestors do.
  static PositionScale from_bounds(const Box& bounds);
  Eigen::Vector3d normalise(const Eigen::Vector3d& p) const { return (p - center).cwiseQuotient(half); }
  Eigen::Vector3d denormalise(const Eigen::Vector3d& x) const { return center + x.cwiseProduct(half); }
};

Vector9 encode_pose(const Pose& world_from_tool, const PositionScale& scale);
Pose decode_pose(const Vector9& x, const PositionScale& scale);

}  // namespace flowscope
