#include "recorder/mesh/cut_planes.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>

namespace flowscope {
namespace {

using Eigen::Vector3d;

constexpr int kAxisCuts = 9;          ///< planes tried along each direction
constexpr std::size_t kCreases = 24;  ///< planes tried along inward creases

/// The same of the two directions of a line whatever the last digits say.
Vector3d one_way(const Vector3d& direction) {
  for (int i = 0; i < 3; ++i)
    if (std::abs(direction[i]) > 1e-3) return direction[i] > 0 ? direction : Vector3d(-direction);
  return direction;
}

/// Main axes of the corners. Those that the shape leaves open (of a ring: all in its plane) follow the axes
/// of space.
std::vector<Vector3d> main_axes(const std::vector<Vector3d>& corners) {
  Vector3d mean = Vector3d::Zero();
  for (const Vector3d& v : corners) mean += v / static_cast<double>(corners.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Vector3d& v : corners) spread += (v - mean) * (v - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
  const Vector3d& values = solver.eigenvalues();
  const auto alike = [&](int i, int k) { return values[k] - values[i] < 0.02 * values[2]; };
  if (alike(0, 1) && alike(1, 2)) return {};
  if (!alike(0, 1) && !alike(1, 2))
    return {solver.eigenvectors().col(0), solver.eigenvectors().col(1), solver.eigenvectors().col(2)};
  const Vector3d alone = solver.eigenvectors().col(alike(0, 1) ? 2 : 0);
  int across = 0;  // the axis of space that is farthest from it, the first of equals
  for (int i = 1; i < 3; ++i)
    if (std::abs(alone[i]) < std::abs(alone[across]) - 1e-3) across = i;
  const Vector3d second = (Vector3d::Unit(across) - alone[across] * alone).normalized();
  return {alone, second, alone.cross(second)};
}

/// What the cuts leave of a crease; nothing where it lies on one of them.
double length_below(const Crease& crease, const std::vector<Plane>& cuts, double hair) {
  double from = 0, to = 1;
  const Vector3d along = crease.to - crease.from;
  for (const Plane& cut : cuts) {
    const double start = cut.normal.dot(crease.from) - cut.offset, rise = cut.normal.dot(along);
    if (std::max(start, start + rise) <= -hair) continue;
    if (std::min(start, start + rise) > -hair) return 0;
    const double crossing = (-hair - start) / rise;
    (rise > 0 ? to : from) = rise > 0 ? std::min(to, crossing) : std::max(from, crossing);
  }
  return std::max(0.0, to - from) * along.norm();
}

std::vector<Plane> crease_planes(const CutMesh& part, const std::vector<Crease>& creases, double size) {
  std::vector<std::pair<double, const Crease*>> found;
  for (const Crease& crease : creases) {
    const double length = length_below(crease, part.cuts, 1e-5 * size);
    // Rounded: equally long creases keep their order whatever the last digits say.
    const double weight = std::round(1e4 * length * crease.turn / size);
    if (length > 1e-3 * size) found.push_back({weight, &crease});
  }
  std::ranges::stable_sort(found, std::greater{}, [](const auto& one) { return one.first; });
  std::vector<Plane> planes;
  for (const auto& [weight, crease] : found) {
    for (const Plane& plane : crease->planes) {
      const bool known = std::ranges::any_of(planes, [&](const Plane& p) {
        return std::abs(p.normal.dot(plane.normal)) > 0.9999 &&
               std::abs(p.offset - plane.offset * (p.normal.dot(plane.normal) > 0 ? 1 : -1)) < 1e-4 * size;
      });
      if (known) continue;
      planes.push_back(plane);
      if (planes.size() >= kCreases) return planes;
    }
  }
  return planes;
}

}  // namespace

std::vector<Crease> creases_of(const TriangleMesh& mesh) {
  std::map<std::pair<int, int>, std::vector<std::size_t>> on_edge;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k)
      on_edge[std::minmax(mesh.triangles[i][k], mesh.triangles[i][(k + 1) % 3])].push_back(i);
  const auto at = [&](int v) -> const Vector3d& { return mesh.vertices[static_cast<std::size_t>(v)]; };
  const auto normal = [&](std::size_t i) -> Vector3d {
    const auto& t = mesh.triangles[i];
    return (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0]));
  };
  const double size = extent_of(mesh.vertices).size().norm();
  std::vector<Crease> found;
  for (const auto& [edge, faces] : on_edge) {
    if (faces.size() != 2) continue;
    const Vector3d a = normal(faces[0]), b = normal(faces[1]);
    if (std::min(a.norm(), b.norm()) < 1e-10 * size * size) continue;
    const auto& t = mesh.triangles[faces[1]];
    const int apex = t[0] + t[1] + t[2] - edge.first - edge.second;
    const Vector3d n = a.normalized(), m = b.normalized(), start = at(edge.first);
    const double inwards = n.dot(at(apex) - start);  // the neighbour rises above this face
    const double turn = 1 - n.dot(m);
    if (inwards <= 0 || turn < 0.02) continue;
    found.push_back({start, at(edge.second), turn, {Plane{n, n.dot(start)}, Plane{m, m.dot(start)}}});
  }
  return found;
}

std::vector<Plane> planes_to_try(const CutMesh& part, const std::vector<Crease>& creases) {
  const std::vector<Vector3d> corners = surface_corners(part);
  std::vector<Plane> planes = crease_planes(part, creases, extent_of(corners).size().norm());
  std::vector<Vector3d> directions{Vector3d::UnitX(), Vector3d::UnitY(), Vector3d::UnitZ()};
  for (const Vector3d& axis : main_axes(corners))
    if (axis.cwiseAbs().maxCoeff() < 0.999) directions.push_back(one_way(axis));
  for (const Vector3d& direction : directions) {
    double low = 1e300, high = -1e300;
    for (const Vector3d& v : corners) {
      low = std::min(low, direction.dot(v));
      high = std::max(high, direction.dot(v));
    }
    for (int k = 1; k <= kAxisCuts; ++k)
      planes.push_back({direction, low + (high - low) * k / (kAxisCuts + 1)});
  }
  return planes;
}

}  // namespace flowscope
