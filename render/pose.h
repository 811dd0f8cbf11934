// A rigid transform: the value that every folder speaks.
#pragma once

#include <Eigen/Geometry>

namespace flowscope {

/// Pose of frame B seen from frame A, named `a_from_b` by its owner: p_A = rotation * p_B + position.
/// Position in metres; rotation is a unit quaternion. Written w,x,y,z everywhere (Eigen keeps x,y,z,w in
/// memory: use `wxyz()` / `from_wxyz()` at every door, never `coeffs()`).
struct Pose {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();

  static Pose from_wxyz(const Eigen::Vector3d& position_m, const Eigen::Vector4d& wxyz) {
    return {position_m, Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]).normalized()};
  }
  Eigen::Vector4d wxyz() const { return {rotation.w(), rotation.x(), rotation.y(), rotation.z()}; }

  /// a_from_b * b_from_c = a_from_c.
  Pose operator*(const Pose& other) const {
    return {position + rotation * other.position, (rotation * other.rotation).normalized()};
  }
  Eigen::Vector3d operator*(const Eigen::Vector3d& p) const { return position + rotation * p; }
  Pose inverse() const {
    const Eigen::Quaterniond r = rotation.conjugate();
    return {-(r * position), r};
  }
  bool operator==(const Pose& o) const {
    return position == o.position && rotation.coeffs() == o.rotation.coeffs();
  }
};

inline double position_error_m(const Pose& a, const Pose& b) { return (a.position - b.position).norm(); }
/// Angle of the rotation between both, in radians, in [0, pi].
inline double rotation_error_rad(const Pose& a, const Pose& b) {
  return a.rotation.angularDistance(b.rotation);
}

}  // namespace flowscope
