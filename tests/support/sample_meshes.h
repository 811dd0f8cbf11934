// Shapes with known volumes, as meshes and as the text of mesh files.
#pragma once

#include <cmath>
#include <numbers>
#include <numeric>
#include <sstream>
#include <string>

#include "recorder/mesh/mesh.h"

namespace flowscope::testing {

using Eigen::Vector3d;

/// Closed by the way its faces are given: each face a polygon, counter-clockwise from outside.
inline TriangleMesh from_faces(const std::vector<Vector3d>& vertices,
                               const std::vector<std::vector<int>>& faces) {
  TriangleMesh mesh{vertices, {}, {}};
  for (const auto& face : faces)
    for (std::size_t k = 1; k + 1 < face.size(); ++k)
      mesh.triangles.push_back({face[0], face[k], face[k + 1]});
  return mesh;
}

/// An outline in x and z, counter-clockwise as seen from -y (z up, x right), with `middle` faces for its two
/// sides, as thick as `depth` along y.
inline TriangleMesh prism(const std::vector<std::array<double, 2>>& outline, double depth,
                          const std::vector<std::vector<int>>& sides) {
  const int n = static_cast<int>(outline.size());
  std::vector<Vector3d> vertices;
  for (const double y : {0.0, depth})
    for (const auto& [x, z] : outline) vertices.emplace_back(x, y, z);
  std::vector<std::vector<int>> faces;
  for (int i = 0; i < n; ++i) faces.push_back({i, i + n, (i + 1) % n + n, (i + 1) % n});
  for (const auto& side : sides) {
    faces.push_back(side);
    std::vector<int> back;
    for (auto it = side.rbegin(); it != side.rend(); ++it) back.push_back(*it + n);
    faces.push_back(back);
  }
  return from_faces(vertices, faces);
}

inline TriangleMesh box(const Vector3d& size) {
  return prism({{0, 0}, {size.x(), 0}, {size.x(), size.z()}, {0, size.z()}}, size.y(), {{0, 1, 2, 3}});
}

/// Two bars of 100 x 30 x 20 mm and 20 x 30 x 60 mm that share a corner: 96 000 mm^3.
inline TriangleMesh l_shape() {
  return prism({{0, 0}, {0.10, 0}, {0.10, 0.02}, {0.02, 0.02}, {0.02, 0.08}, {0, 0.08}}, 0.03,
               {{0, 1, 2, 3}, {0, 3, 4, 5}});
}

/// A profile of (radius, z) turned about z, from axis to axis; `segments` around.
inline TriangleMesh turned(const std::vector<std::array<double, 2>>& profile, int segments) {
  std::vector<Vector3d> vertices;
  std::vector<std::vector<int>> faces;
  const int rings = static_cast<int>(profile.size()) - 2;
  vertices.emplace_back(0, 0, profile.front()[1]);
  for (int r = 1; r <= rings; ++r)
    for (int k = 0; k < segments; ++k) {
      const double angle = 2 * std::numbers::pi * k / segments;
      const auto& [radius, z] = profile[static_cast<std::size_t>(r)];
      vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
    }
  vertices.emplace_back(0, 0, profile.back()[1]);
  const int last = static_cast<int>(vertices.size()) - 1;
  const auto at = [&](int ring, int k) { return 1 + (ring - 1) * segments + k % segments; };
  for (int k = 0; k < segments; ++k) {
    faces.push_back({0, at(1, k + 1), at(1, k)});
    for (int r = 1; r < rings; ++r) faces.push_back({at(r, k), at(r, k + 1), at(r + 1, k + 1), at(r + 1, k)});
    faces.push_back({last, at(rings, k), at(rings, k + 1)});
  }
  return from_faces(vertices, faces);
}

/// 80 mm wide, 90 mm high, wall 4 mm, floor 6 mm.
inline TriangleMesh cup(int segments = 24) {
  return turned({{0, 0}, {0.040, 0}, {0.040, 0.090}, {0.036, 0.090}, {0.036, 0.006}, {0, 0.006}}, segments);
}

/// Corners of a regular polygon's outline at `count` even angles, at a height.
inline std::vector<Vector3d> outline(int sides, double radius, int count, double z) {
  std::vector<Vector3d> points;
  for (int k = 0; k < count; ++k) {
    const double place = 1.0 * k * sides / count, share = place - std::floor(place);
    const double angle = 2 * std::numbers::pi / sides, from = angle * std::floor(place);
    const auto corner = [&](double a) { return Vector3d(radius * std::cos(a), radius * std::sin(a), z); };
    points.push_back((1 - share) * corner(from) + share * corner(from + angle));
  }
  return points;
}

/// A plate with a hole along z, both regular polygons about it: washers, nuts, frames.
inline TriangleMesh ring(int outer_sides, double outer, int hole_sides, double hole, double height) {
  const int n = std::lcm(outer_sides, hole_sides);
  std::vector<Vector3d> vertices;
  for (const double z : {0.0, height})
    for (const auto& points : {outline(outer_sides, outer, n, z), outline(hole_sides, hole, n, z)})
      vertices.insert(vertices.end(), points.begin(), points.end());
  std::vector<std::vector<int>> faces;
  for (int k = 0; k < n; ++k) {
    const int out = k, next = (k + 1) % n, in = n + k, in_next = n + next;
    faces.push_back({out, next, next + 2 * n, out + 2 * n});
    faces.push_back({in_next, in, in + 2 * n, in_next + 2 * n});
    faces.push_back({next, out, in, in_next});
    faces.push_back({out + 2 * n, next + 2 * n, in_next + 2 * n, in + 2 * n});
  }
  return from_faces(vertices, faces);
}

/// A plate with a hollow in its top that does not go through.
inline TriangleMesh pocket(int sides, double outer, double inner, double height, double floor) {
  std::vector<Vector3d> vertices;
  for (const auto& points : {outline(sides, outer, sides, 0), outline(sides, outer, sides, height),
                             outline(sides, inner, sides, height), outline(sides, inner, sides, floor)})
    vertices.insert(vertices.end(), points.begin(), points.end());
  std::vector<int> bottom, ground;
  std::vector<std::vector<int>> faces;
  for (int k = 0; k < sides; ++k) {
    const int next = (k + 1) % sides;
    bottom.insert(bottom.begin(), k);
    ground.push_back(3 * sides + k);
    for (int level = 0; level < 3; ++level)
      faces.push_back(
          {level * sides + k, level * sides + next, (level + 1) * sides + next, (level + 1) * sides + k});
  }
  faces.push_back(bottom);
  faces.push_back(ground);
  return from_faces(vertices, faces);
}

inline TriangleMesh sphere(double radius, int rings, int segments) {
  std::vector<std::array<double, 2>> profile;
  for (int i = 0; i <= rings; ++i) {
    const double angle = std::numbers::pi * i / rings;
    profile.push_back({radius * std::sin(angle), -radius * std::cos(angle)});
  }
  return turned(profile, segments);
}

inline std::string as_obj(const TriangleMesh& mesh, double scale = 1) {
  std::ostringstream text;
  text.precision(9);
  for (const Vector3d& v : mesh.vertices)
    text << "v " << scale * v.x() << ' ' << scale * v.y() << ' ' << scale * v.z() << '\n';
  for (const auto& t : mesh.triangles) text << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
  return text.str();
}

}  // namespace flowscope::testing
