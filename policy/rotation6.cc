#include "policy/rotation6.h"

namespace flowscope {
namespace {

Eigen::Vector3d unit(const Eigen::Vector3d& v, const Eigen::Vector3d& fallback) {
  const double n = v.norm();
  return n > 1e-8 ? Eigen::Vector3d(v / n) : fallback;
}

}  // namespace

Eigen::Matrix<double, 6, 1> rotation_to_6d(const Eigen::Quaterniond& rotation) {
  const Eigen::Matrix3d m = rotation.normalized().toRotationMatrix();
  Eigen::Matrix<double, 6, 1> out;
  out << m.col(0), m.col(1);
  return out;
}

Eigen::Quaterniond rotation_from_6d(const Eigen::Matrix<double, 6, 1>& columns) {
  const Eigen::Vector3d x = unit(columns.head<3>(), Eigen::Vector3d::UnitX());
  const Eigen::Vector3d z = unit(x.cross(Eigen::Vector3d(columns.tail<3>())), x.unitOrthogonal());
  Eigen::Matrix3d m;
  m << x, z.cross(x), z;
  return Eigen::Quaterniond(m).normalized();
}

PositionScale PositionScale::from_bounds(const Box& bounds) {
  constexpr double widen_m = 0.04;
  return {0.5 * (bounds.min + bounds.max),
          0.5 * (bounds.max - bounds.min) + Eigen::Vector3d::Constant(widen_m)};
}

Vector9 encode_pose(const Pose& world_from_tool, const PositionScale& scale) {
  Vector9 x{};
  Eigen::Map<Eigen::Vector3d>(x.data()) = scale.normalise(world_from_tool.position);
  Eigen::Map<Eigen::Matrix<double, 6, 1>>(x.data() + 3) = rotation_to_6d(world_from_tool.rotation);
  return x;
}

Pose decode_pose(const Vector9& x, const PositionScale& scale) {
  return {scale.denormalise(Eigen::Map<const Eigen::Vector3d>(x.data())),
          rotation_from_6d(Eigen::Map<const Eigen::Matrix<double, 6, 1>>(x.data() + 3))};
}

}  // namespace flowscope
