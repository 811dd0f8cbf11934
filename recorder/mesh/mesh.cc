#include "recorder/mesh/mesh.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <queue>
#include <set>

namespace flowscope {
namespace {

using Eigen::Vector3d;
using Triangle = std::array<int, 3>;
using Edge = std::pair<int, int>;

void weld(TriangleMesh& mesh) {
  const Extent extent = extent_of(mesh.vertices);
  const double cell = std::max(1e-12, 1e-6 * extent.size().norm());
  std::map<std::array<std::int64_t, 3>, int> known;
  std::vector<int> to(mesh.vertices.size());
  std::vector<Vector3d> kept;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Vector3d scaled = (mesh.vertices[i] - extent.low) / cell;
    const std::array<std::int64_t, 3> key{std::llround(scaled.x()), std::llround(scaled.y()),
                                          std::llround(scaled.z())};
    const auto [it, fresh] = known.try_emplace(key, static_cast<int>(kept.size()));
    if (fresh) kept.push_back(mesh.vertices[i]);
    to[i] = it->second;
  }
  mesh.vertices = std::move(kept);
  for (Triangle& t : mesh.triangles)
    for (int& corner : t) corner = to[static_cast<std::size_t>(corner)];
}

double doubled_area(const TriangleMesh& mesh, const Triangle& t) {
  const auto at = [&](int k) -> const Vector3d& {
    return mesh.vertices[static_cast<std::size_t>(t[static_cast<std::size_t>(k)])];
  };
  return (at(1) - at(0)).cross(at(2) - at(0)).norm();
}

void drop_useless(TriangleMesh& mesh) {
  const double size = extent_of(mesh.vertices).size().norm();
  std::set<Triangle> seen;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Triangle t = mesh.triangles[i];
    if (t[0] == t[1] || t[1] == t[2] || t[0] == t[2] || doubled_area(mesh, t) < 1e-14 * size * size) continue;
    Triangle key = t;
    std::rotate(key.begin(), std::min_element(key.begin(), key.end()), key.end());
    if (!seen.insert(key).second) continue;
    mesh.triangles[kept] = t;
    if (!mesh.colors.empty()) mesh.colors[kept] = mesh.colors[i];
    if (!mesh.texture_of.empty()) mesh.texture_of[kept] = mesh.texture_of[i];
    if (!mesh.texture_corners.empty()) mesh.texture_corners[kept] = mesh.texture_corners[i];
    ++kept;
  }
  mesh.triangles.resize(kept);
  if (!mesh.colors.empty()) mesh.colors.resize(kept);
  if (!mesh.texture_of.empty()) mesh.texture_of.resize(kept);
  if (!mesh.texture_corners.empty()) mesh.texture_corners.resize(kept);
}

void turn_over(TriangleMesh& mesh, std::size_t triangle) {
  std::swap(mesh.triangles[triangle][1], mesh.triangles[triangle][2]);
  if (mesh.texture_corners.empty()) return;
  std::swap(mesh.texture_corners[triangle][1], mesh.texture_corners[triangle][2]);
}

/// Walks over edges that join exactly two triangles and turns the second to match the first.
void orient_alike(TriangleMesh& mesh) {
  std::map<Edge, std::vector<int>> on_edge;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Triangle& t = mesh.triangles[i];
    for (std::size_t k = 0; k < 3; ++k)
      on_edge[std::minmax(t[k], t[(k + 1) % 3])].push_back(static_cast<int>(i));
  }
  const auto has = [&](int triangle, const Edge& edge) {
    const Triangle& t = mesh.triangles[static_cast<std::size_t>(triangle)];
    for (std::size_t k = 0; k < 3; ++k)
      if (t[k] == edge.first && t[(k + 1) % 3] == edge.second) return true;
    return false;
  };
  std::vector<bool> done(mesh.triangles.size());
  for (std::size_t seed = 0; seed < done.size(); ++seed) {
    if (done[seed]) continue;
    std::queue<int> todo({static_cast<int>(seed)});
    done[seed] = true;
    for (; !todo.empty(); todo.pop()) {
      const Triangle t = mesh.triangles[static_cast<std::size_t>(todo.front())];
      for (std::size_t k = 0; k < 3; ++k) {
        const auto& pair = on_edge[std::minmax(t[k], t[(k + 1) % 3])];
        if (pair.size() != 2) continue;
        const int other = pair[0] == todo.front() ? pair[1] : pair[0];
        if (done[static_cast<std::size_t>(other)]) continue;
        done[static_cast<std::size_t>(other)] = true;
        if (has(other, {t[k], t[(k + 1) % 3]})) turn_over(mesh, static_cast<std::size_t>(other));
        todo.push(other);
      }
    }
  }
}

}  // namespace

Extent extent_of(const std::vector<Vector3d>& points) {
  if (points.empty()) return {};
  Extent extent{points[0], points[0]};
  for (const Vector3d& p : points) {
    extent.low = extent.low.cwiseMin(p);
    extent.high = extent.high.cwiseMax(p);
  }
  return extent;
}

void append(TriangleMesh& mesh, const TriangleMesh& other) {
  const int first = static_cast<int>(mesh.vertices.size());
  const int first_texture = static_cast<int>(mesh.textures.size());
  const std::size_t before = mesh.triangles.size();
  mesh.vertices.insert(mesh.vertices.end(), other.vertices.begin(), other.vertices.end());
  for (const Triangle& t : other.triangles)
    mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  mesh.colors.insert(mesh.colors.end(), other.colors.begin(), other.colors.end());
  if (mesh.texture_of.empty() && other.texture_of.empty()) return;
  mesh.textures.insert(mesh.textures.end(), other.textures.begin(), other.textures.end());
  mesh.texture_of.resize(before, -1);
  mesh.texture_corners.resize(before);
  for (const int texture : other.texture_of)
    mesh.texture_of.push_back(texture < 0 ? -1 : texture + first_texture);
  mesh.texture_corners.insert(mesh.texture_corners.end(), other.texture_corners.begin(),
                              other.texture_corners.end());
  mesh.texture_of.resize(mesh.triangles.size(), -1);
  mesh.texture_corners.resize(mesh.triangles.size());
}

void tidy(TriangleMesh& mesh) {
  weld(mesh);
  drop_useless(mesh);
  if (!is_closed(mesh)) orient_alike(mesh);
  if (is_closed(mesh) && mass_properties(mesh).volume < 0)
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) turn_over(mesh, i);
}

bool is_closed(const TriangleMesh& mesh) {
  std::map<Edge, int> balance;
  for (const Triangle& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const int a = t[k], b = t[(k + 1) % 3];
      balance[std::minmax(a, b)] += a < b ? 1 : -1;
    }
  return !balance.empty() && std::ranges::all_of(balance, [](const auto& e) { return e.second == 0; });
}

MassProperties mass_properties(const TriangleMesh& mesh) {
  MassProperties result;
  if (mesh.vertices.empty()) return result;
  // Tetrahedra from a point near the mesh: far from it the sum would lose digits.
  const Extent extent = extent_of(mesh.vertices);
  const Vector3d origin = 0.5 * (extent.low + extent.high);
  const Eigen::Matrix3d unit = (Eigen::Matrix3d::Identity() + Eigen::Matrix3d::Ones()) / 120;
  double six_volumes = 0;
  Vector3d moment = Vector3d::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();  // integral of x x^T
  for (const Triangle& t : mesh.triangles) {
    Eigen::Matrix3d corners;
    for (int k = 0; k < 3; ++k)
      corners.col(k) = mesh.vertices[static_cast<std::size_t>(t[static_cast<std::size_t>(k)])] - origin;
    const double det = corners.determinant();
    six_volumes += det;
    moment += det * corners.rowwise().sum();
    second += det * corners * unit * corners.transpose();
  }
  result.volume = six_volumes / 6;
  if (std::abs(result.volume) < 1e-300) return result;
  const Vector3d offset = moment / (24 * result.volume);
  result.center = origin + offset;
  second -= result.volume * offset * offset.transpose();
  result.inertia = second.trace() * Eigen::Matrix3d::Identity() - second;
  return result;
}

}  // namespace flowscope
