#include "recorder/mesh/cut_trial.h"

#include <algorithm>
#include <array>

#include "recorder/mesh/convex_hull.h"

namespace flowscope {

using Eigen::Vector3d;

namespace {

constexpr double kHair = 1e-6;  ///< of a shape of size 1

}  // namespace

CutTrial::CutTrial(const CutMesh& part, const std::vector<Vector3d>& inner, const TriangleMesh& whole,
                   bool closed)
    : part_(part), inner_(inner), whole_(whole), closed_(closed) {
  const TriangleMesh& mesh = part.mesh;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    if (!part.is_lid.empty() && part.is_lid[i]) continue;
    const auto& t = mesh.triangles[i];
    for (std::size_t k = 0; k < 3; ++k) edges_.push_back(std::minmax(t[k], t[(k + 1) % 3]));
  }
  std::ranges::sort(edges_);
  edges_.erase(std::ranges::unique(edges_).begin(), edges_.end());
}

CutVolumes CutTrial::measure(const Plane& plane) const {
  const std::vector<double> height = heights(part_.mesh, plane);
  const auto above = [&](int v) { return height[static_cast<std::size_t>(v)]; };
  const auto at = [&](int v) -> const Vector3d& { return part_.mesh.vertices[static_cast<std::size_t>(v)]; };
  std::vector<Vector3d> low, high;
  const Sides sides = sides_of(plane, height);
  for (std::size_t v = 0; v < height.size(); ++v) {
    if (sides.low[v]) low.push_back(part_.mesh.vertices[v]);
    if (sides.high[v]) high.push_back(part_.mesh.vertices[v]);
  }
  for (const auto& [a, b] : edges_) {
    if (above(a) * above(b) >= 0) continue;
    const double t = above(a) / (above(a) - above(b));
    low.push_back(at(a) + t * (at(b) - at(a)));
    high.push_back(low.back());
  }
  for (const Vector3d& p : inner_) {
    const double over = plane.normal.dot(p) - plane.offset;
    if (over < kHair) low.push_back(p);
    if (over > -kHair) high.push_back(p);
  }
  if (closed_) {
    for (const Vector3d& p : inner_corners(part_.cuts, plane, whole_)) low.push_back(p), high.push_back(p);
  }
  return {closed_ ? volume_below(plane, height) : 0, hull_volume(low), hull_volume(high)};
}

/// A corner in the plane belongs to the sides that its triangles lie on, or are the lid or the floor of.
CutTrial::Sides CutTrial::sides_of(const Plane& plane, const std::vector<double>& height) const {
  Sides sides{std::vector<bool>(height.size(), false), std::vector<bool>(height.size(), false)};
  const TriangleMesh& mesh = part_.mesh;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    if (!part_.is_lid.empty() && part_.is_lid[i]) continue;
    const auto& t = mesh.triangles[i];
    const auto index = [&](std::size_t k) { return static_cast<std::size_t>(t[k]); };
    double lowest = std::min({height[index(0)], height[index(1)], height[index(2)]});
    double highest = std::max({height[index(0)], height[index(1)], height[index(2)]});
    if (lowest == 0 && highest == 0) {
      const auto at = [&](std::size_t k) -> const Vector3d& { return mesh.vertices[index(k)]; };
      const bool lid = (at(1) - at(0)).cross(at(2) - at(0)).dot(plane.normal) >= 0;
      (lid ? lowest : highest) = lid ? -1 : 1;
    }
    for (std::size_t k = 0; k < 3; ++k) {
      if (lowest < 0 && height[index(k)] <= 0) sides.low[index(k)] = true;
      if (highest > 0 && height[index(k)] >= 0) sides.high[index(k)] = true;
    }
  }
  return sides;
}

/// Tetrahedra from a point of the plane: whatever closes the cut adds nothing.
double CutTrial::volume_below(const Plane& plane, const std::vector<double>& height) const {
  const TriangleMesh& mesh = part_.mesh;
  if (mesh.vertices.empty()) return 0;
  const Vector3d& near = mesh.vertices.front();
  const Vector3d apex = near - (plane.normal.dot(near) - plane.offset) * plane.normal;
  double six_volumes = 0;
  for (const auto& t : mesh.triangles) {
    std::array<Vector3d, 4> polygon;
    std::size_t corners = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto a = static_cast<std::size_t>(t[k]), b = static_cast<std::size_t>(t[(k + 1) % 3]);
      if (height[a] <= 0) polygon[corners++] = mesh.vertices[a] - apex;
      if (height[a] * height[b] < 0)
        polygon[corners++] = mesh.vertices[a] +
                             height[a] / (height[a] - height[b]) * (mesh.vertices[b] - mesh.vertices[a]) -
                             apex;
    }
    for (std::size_t k = 1; k + 1 < corners; ++k)
      six_volumes += polygon[0].dot(polygon[k].cross(polygon[k + 1]));
  }
  return six_volumes / 6;
}

}  // namespace flowscope
