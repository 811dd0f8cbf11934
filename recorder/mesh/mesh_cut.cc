#include "recorder/mesh/mesh_cut.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

namespace flowscope {
namespace {

using Eigen::Vector3d;
using Edge = std::pair<int, int>;

class Cut {
 public:
  Cut(const CutMesh& part, const Plane& plane)
      : part_(part), mesh_(part.mesh), plane_(plane), height_(heights(part.mesh, plane)) {
    kept_.assign(mesh_.vertices.size(), -1);
  }

  CutMesh below(bool closed) {
    for (std::size_t i = 0; i < mesh_.triangles.size(); ++i) {
      lid_ = !part_.is_lid.empty() && part_.is_lid[i];
      clip(mesh_.triangles[i]);
    }
    if (closed) close();
    out_.is_guess.assign(out_.mesh.vertices.size(), true);
    for (std::size_t i = 0; i < out_.mesh.triangles.size(); ++i)
      if (!out_.is_lid[i])
        for (const int v : out_.mesh.triangles[i]) out_.is_guess[static_cast<std::size_t>(v)] = false;
    return std::move(out_);
  }

 private:
  double height(int v) const { return height_[static_cast<std::size_t>(v)]; }
  const Vector3d& at(int v) const { return mesh_.vertices[static_cast<std::size_t>(v)]; }

  int add(const Vector3d& point, bool on_plane) {
    out_.mesh.vertices.push_back(point);
    on_plane_.push_back(on_plane);
    return static_cast<int>(out_.mesh.vertices.size()) - 1;
  }
  int corner(int v) {
    int& index = kept_[static_cast<std::size_t>(v)];
    if (index < 0) index = add(at(v), height(v) == 0);
    return index;
  }
  int crossing(int a, int b) {
    const auto [it, fresh] = crossings_.try_emplace(std::minmax(a, b), -1);
    if (fresh) {
      const int low = std::min(a, b), high = std::max(a, b);
      const double t = height(low) / (height(low) - height(high));
      it->second = add(at(low) + t * (at(high) - at(low)), true);
    }
    return it->second;
  }

  void add_triangle(const std::array<int, 3>& corners, bool lid) {
    out_.mesh.triangles.push_back(corners);
    out_.is_lid.push_back(lid);
  }

  void clip(const std::array<int, 3>& t) {
    const double highest = std::max({height(t[0]), height(t[1]), height(t[2])});
    const double lowest = std::min({height(t[0]), height(t[1]), height(t[2])});
    if (lowest > 0 || (lowest == 0 && highest > 0)) return;
    if (lowest == 0 && highest == 0) {
      // In the plane: the lid of what is below when it looks up, the floor of what is above otherwise.
      if ((at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])).dot(plane_.normal) < 0) return;
    }
    std::vector<int> polygon;
    for (std::size_t k = 0; k < 3; ++k) {
      const int a = t[k], b = t[(k + 1) % 3];
      if (height(a) <= 0) polygon.push_back(corner(a));
      if ((height(a) < 0 && height(b) > 0) || (height(a) > 0 && height(b) < 0))
        polygon.push_back(crossing(a, b));
    }
    for (std::size_t k = 1; k + 1 < polygon.size(); ++k)
      add_triangle({polygon[0], polygon[k], polygon[k + 1]}, lid_);
    for (std::size_t k = 0; k < polygon.size(); ++k) {
      const int a = polygon[k], b = polygon[(k + 1) % polygon.size()];
      if (!on_plane_[static_cast<std::size_t>(a)] || !on_plane_[static_cast<std::size_t>(b)]) continue;
      rim_[std::minmax(a, b)] += a < b ? 1 : -1;
    }
  }

  /// Goes along each edge of the rim against the way that the mesh goes along it.
  void close() {
    int hub = -1;
    for (const auto& [edge, times] : rim_) {
      if (times == 0) continue;
      if (hub < 0) hub = edge.first;
      if (edge.first == hub || edge.second == hub) continue;
      for (int i = 0; i < std::abs(times); ++i)
        add_triangle(times > 0 ? std::array<int, 3>{hub, edge.second, edge.first}
                               : std::array<int, 3>{hub, edge.first, edge.second},
                     true);
    }
  }

  const CutMesh& part_;
  const TriangleMesh& mesh_;
  const Plane& plane_;
  bool lid_ = false;            ///< what is being clipped
  std::vector<double> height_;  ///< of each corner above the plane
  std::vector<int> kept_;       ///< its index in the part, or -1
  std::map<Edge, int> crossings_, rim_;
  std::vector<bool> on_plane_;
  CutMesh out_;
};

}  // namespace

CutMesh below(const CutMesh& part, const Plane& plane, bool closed) {
  CutMesh result = Cut(part, plane).below(closed);
  result.cuts = part.cuts;
  result.cuts.push_back(plane);
  return result;
}

std::vector<double> heights(const TriangleMesh& mesh, const Plane& plane) {
  const double snap = 1e-6 * extent_of(mesh.vertices).size().norm();
  std::vector<double> result;
  result.reserve(mesh.vertices.size());
  for (const Vector3d& v : mesh.vertices) {
    const double height = plane.normal.dot(v) - plane.offset;
    result.push_back(std::abs(height) < snap ? 0 : height);
  }
  return result;
}

namespace {

/// Not on a face: there the surface has corners of its own, and the winding number is noise.
bool is_inside(const TriangleMesh& whole, const Vector3d& point, double hair) {
  const Vector3d aside = hair * Vector3d(0.36, 0.48, 0.8);  // along no face that anyone makes
  return winding_number(whole, point + aside) > 0.5 && winding_number(whole, point - aside) > 0.5;
}

}  // namespace

std::vector<Vector3d> inner_corners(const std::vector<Plane>& cuts, const Plane& plane,
                                    const TriangleMesh& whole) {
  std::vector<Vector3d> found;
  const double hair = 1e-6 * extent_of(whole.vertices).size().norm();
  for (std::size_t i = 0; i < cuts.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      Eigen::Matrix3d normals;
      normals << plane.normal.transpose(), cuts[i].normal.transpose(), cuts[k].normal.transpose();
      if (std::abs(normals.determinant()) < 1e-4) continue;
      const Vector3d p = normals.inverse() * Vector3d(plane.offset, cuts[i].offset, cuts[k].offset);
      const bool below_all =
          std::ranges::all_of(cuts, [&](const Plane& cut) { return cut.normal.dot(p) < cut.offset + hair; });
      if (below_all && is_inside(whole, p, hair)) found.push_back(p);
    }
  }
  return found;
}

std::vector<Vector3d> surface_corners(const CutMesh& part) {
  std::vector<Vector3d> corners;
  for (std::size_t i = 0; i < part.mesh.vertices.size(); ++i)
    if (part.is_guess.empty() || !part.is_guess[i]) corners.push_back(part.mesh.vertices[i]);
  return corners;
}

std::vector<Vector3d> corners_of(const CutMesh& part, const TriangleMesh& whole) {
  std::vector<Vector3d> corners = surface_corners(part);
  std::vector<Plane> before;
  for (const Plane& cut : part.cuts) {
    const double hair = 1e-6 * extent_of(whole.vertices).size().norm();
    for (const Vector3d& p : inner_corners(before, cut, whole))
      if (std::ranges::all_of(part.cuts, [&](const Plane& c) { return c.normal.dot(p) < c.offset + hair; }))
        corners.push_back(p);
    before.push_back(cut);
  }
  return corners;
}

double winding_number(const TriangleMesh& mesh, const Vector3d& point) {
  double angle = 0;  // van Oosterom and Strackee's solid angle, halved
  for (const auto& t : mesh.triangles) {
    const Vector3d a = mesh.vertices[static_cast<std::size_t>(t[0])] - point;
    const Vector3d b = mesh.vertices[static_cast<std::size_t>(t[1])] - point;
    const Vector3d c = mesh.vertices[static_cast<std::size_t>(t[2])] - point;
    const double x = a.norm(), y = b.norm(), z = c.norm();
    angle += std::atan2(a.dot(b.cross(c)), x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y);
  }
  return angle / (2 * std::numbers::pi);
}

}  // namespace flowscope
