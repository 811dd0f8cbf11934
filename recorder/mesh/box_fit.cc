#include "recorder/mesh/box_fit.h"

#include <algorithm>
#include <cmath>

namespace flowscope {
namespace {

using Eigen::Vector3d;

constexpr double kFilled = 0.995;

/// Doubled area times normal of each face.
std::vector<Vector3d> face_normals(const TriangleMesh& hull) {
  std::vector<Vector3d> normals;
  for (const auto& t : hull.triangles) {
    const auto at = [&](std::size_t k) -> const Vector3d& {
      return hull.vertices[static_cast<std::size_t>(t[k])];
    };
    normals.push_back((at(1) - at(0)).cross(at(2) - at(0)));
  }
  return normals;
}

}  // namespace

std::optional<FittedBox> fitted_box(const TriangleMesh& hull) {
  std::vector<Vector3d> normals = face_normals(hull);
  if (normals.empty()) return std::nullopt;
  std::ranges::sort(normals, std::greater{}, [](const Vector3d& n) { return n.squaredNorm(); });
  const Vector3d x = normals.front().normalized();
  const auto across = std::ranges::find_if(
      normals, [&](const Vector3d& n) { return std::abs(n.normalized().dot(x)) < 1e-3; });
  if (across == normals.end()) return std::nullopt;
  const Vector3d y = (*across - x * x.dot(*across)).normalized();
  Eigen::Matrix3d axes;
  axes << x, y, x.cross(y);
  std::vector<Vector3d> turned;
  for (const Vector3d& v : hull.vertices) turned.push_back(axes.transpose() * v);
  const Extent extent = extent_of(turned);
  if (mass_properties(hull).volume < kFilled * extent.size().prod()) return std::nullopt;
  return FittedBox{{axes * (0.5 * (extent.low + extent.high)), Eigen::Quaterniond(axes)},
                   0.5 * extent.size()};
}

}  // namespace flowscope
