#include "recorder/mesh/convex_parts.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "recorder/mesh/convex_hull.h"
#include "recorder/mesh/mesh_cut.h"

namespace flowscope {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kCoarse_triangles = 900;
constexpr int kAxisCuts = 9;          ///< planes tried along each direction
constexpr std::size_t kCreases = 24;  ///< planes tried along inward creases
constexpr double kBalance = 0.03;     ///< how much an even cut is worth against volume saved
constexpr double kSheetGain = 0.01;   ///< an open mesh is cut while that saves this much of its hull
constexpr int kPatience = 3;          ///< cuts in a row that may save nothing

/// The mesh with its corners drawn to a grid: a closed one stays closed.
TriangleMesh coarse(const TriangleMesh& mesh) {
  TriangleMesh copy{mesh.vertices, mesh.triangles};
  const Extent extent = extent_of(mesh.vertices);
  for (double cells = 48; copy.triangles.size() > kCoarse_triangles && cells > 4; cells *= 0.8) {
    const double cell = extent.size().maxCoeff() / cells;
    std::map<std::array<int, 3>, int> known;
    std::vector<int> to;
    copy = {};
    for (const Vector3d& v : mesh.vertices) {
      const Vector3d scaled = (v - extent.low) / cell;
      const std::array<int, 3> key{static_cast<int>(scaled.x()), static_cast<int>(scaled.y()),
                                   static_cast<int>(scaled.z())};
      const auto [it, fresh] = known.try_emplace(key, static_cast<int>(copy.vertices.size()));
      if (fresh) copy.vertices.push_back(v);
      to.push_back(it->second);
    }
    for (const auto& t : mesh.triangles) {
      const auto at = [&](std::size_t k) { return to[static_cast<std::size_t>(t[k])]; };
      if (at(0) != at(1) && at(1) != at(2) && at(0) != at(2)) copy.triangles.push_back({at(0), at(1), at(2)});
    }
  }
  return copy;
}

struct Piece {
  CutMesh coarse;
  double hull = 0;    ///< volume, m^3
  double excess = 0;  ///< of the hull over the piece; of an open mesh what the best cut is known to save
  std::vector<Vector3d> points{};
};

struct Split {
  Piece low, high;
  double saved = 0, score = 0;
};

/// Faces' planes at edges where the surface turns inwards, the longest first: exact where parts were joined.
std::vector<Plane> crease_planes(const TriangleMesh& mesh) {
  std::map<std::pair<int, int>, std::vector<std::size_t>> on_edge;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k)
      on_edge[std::minmax(mesh.triangles[i][k], mesh.triangles[i][(k + 1) % 3])].push_back(i);
  const auto at = [&](int v) -> const Vector3d& { return mesh.vertices[static_cast<std::size_t>(v)]; };
  const auto normal = [&](std::size_t i) -> Vector3d {
    const auto& t = mesh.triangles[i];
    return (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0]));
  };
  std::vector<std::pair<double, Plane>> found;
  for (const auto& [edge, faces] : on_edge) {
    if (faces.size() != 2) continue;
    const Vector3d a = normal(faces[0]), b = normal(faces[1]);
    if (a.norm() < 1e-15 || b.norm() < 1e-15) continue;
    const auto& t = mesh.triangles[faces[1]];
    const int apex = t[0] + t[1] + t[2] - edge.first - edge.second;
    const Vector3d n = a.normalized(), m = b.normalized();
    const double inwards = n.dot(at(apex) - at(edge.first));  // the neighbour rises above this face
    const double turn = 1 - n.dot(m);
    if (inwards <= 0 || turn < 0.02) continue;
    const double weight = (at(edge.second) - at(edge.first)).norm() * turn;
    found.push_back({weight, {n, n.dot(at(edge.first))}});
    found.push_back({weight, {m, m.dot(at(edge.first))}});
  }
  std::ranges::stable_sort(found, [](const auto& x, const auto& y) { return x.first > y.first; });
  std::vector<Plane> planes;
  const double near = 1e-4 * extent_of(mesh.vertices).size().norm();
  for (const auto& [weight, plane] : found) {
    const bool known = std::ranges::any_of(planes, [&](const Plane& p) {
      return std::abs(p.normal.dot(plane.normal)) > 0.9999 &&
             std::abs(p.offset - plane.offset * (p.normal.dot(plane.normal) > 0 ? 1 : -1)) < near;
    });
    if (known) continue;
    planes.push_back(plane);
    if (planes.size() >= kCreases) break;
  }
  return planes;
}

std::vector<Plane> planes_to_try(const TriangleMesh& mesh) {
  std::vector<Plane> planes = crease_planes(mesh);
  Vector3d mean = Vector3d::Zero();
  for (const Vector3d& v : mesh.vertices) mean += v / static_cast<double>(mesh.vertices.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Vector3d& v : mesh.vertices) spread += (v - mean) * (v - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> main_axes(spread);
  std::vector<Vector3d> directions{Vector3d::UnitX(), Vector3d::UnitY(), Vector3d::UnitZ()};
  for (int i = 0; i < 3; ++i) {
    const Vector3d axis = main_axes.eigenvectors().col(i);
    if (axis.cwiseAbs().maxCoeff() < 0.999) directions.push_back(axis);
  }
  for (const Vector3d& direction : directions) {
    double low = 1e300, high = -1e300;
    for (const Vector3d& v : mesh.vertices) {
      low = std::min(low, direction.dot(v));
      high = std::max(high, direction.dot(v));
    }
    for (int k = 1; k <= kAxisCuts; ++k)
      planes.push_back({direction, low + (high - low) * k / (kAxisCuts + 1)});
  }
  return planes;
}

class Decomposition {
 public:
  Decomposition(const TriangleMesh& mesh, const PartOptions& options)
      : mesh_(mesh), options_(options), closed_(is_closed(mesh)) {
    Piece whole;
    coarse_ = coarse(mesh);
    whole.coarse.mesh = coarse_;
    measure(whole);
    total_ = closed_ ? std::max(std::abs(mass_properties(coarse_).volume), 1e-3 * whole.hull) : whole.hull;
    pieces_.push_back(std::move(whole));
  }

  std::vector<TriangleMesh> parts() {
    cut();
    for (Piece& piece : pieces_) piece.points = exact_points(piece);
    std::erase_if(pieces_, [](Piece& piece) { return (piece.hull = hull_volume(piece.points)) <= 0; });
    join();
    std::vector<TriangleMesh> result;
    for (const Piece& piece : pieces_) {
      TriangleMesh hull = simple_hull(piece.points, options_.most_corners);
      if (!hull.triangles.empty()) result.push_back(std::move(hull));
    }
    return result;
  }

 private:
  void measure(Piece& piece) const {
    piece.hull = hull_volume(corners_of(piece.coarse, coarse_));
    piece.excess = closed_ ? piece.hull - mass_properties(piece.coarse.mesh).volume : piece.hull;
  }

  /// Cuts the piece with most to gain until the whole is near enough, or there are enough pieces to join some
  /// again.
  void cut() {
    const std::size_t most = static_cast<std::size_t>(2 * options_.most_parts);
    for (int idle = 0; options_.most_parts > 1 && pieces_.size() < most && idle < kPatience;) {
      double excess = 0;
      for (const Piece& piece : pieces_) excess += std::max(0.0, piece.excess);
      if (closed_ && excess <= options_.concavity * total_) return;
      const auto worst = std::ranges::max_element(pieces_, {}, &Piece::excess);
      if (worst->excess <= 0.1 * options_.concavity * total_) return;
      auto split = best_split(*worst);
      if (!split) {
        worst->excess = 0;
        continue;
      }
      idle = split->saved > (closed_ ? 1e-4 : kSheetGain) * total_ ? 0 : idle + 1;
      *worst = std::move(split->low);
      pieces_.push_back(std::move(split->high));
    }
  }

  std::optional<Split> best_split(const Piece& piece) const {
    std::optional<Split> best;
    for (const Plane& plane : planes_to_try(piece.coarse.mesh)) {
      Split split;
      split.low.coarse = below(piece.coarse, plane, closed_);
      split.high.coarse = below(piece.coarse, plane.turned(), closed_);
      if (split.low.coarse.mesh.vertices.size() < 4 || split.high.coarse.mesh.vertices.size() < 4) continue;
      measure(split.low);
      measure(split.high);
      const double least = 1e-4 * piece.hull;
      if (split.low.hull < least || split.high.hull < least) continue;
      const double sum = split.low.hull + split.high.hull;
      split.saved = piece.hull - sum;
      split.score = sum / piece.hull + kBalance * std::abs(split.low.hull - split.high.hull) / sum;
      if (best && best->score <= split.score) continue;
      best = std::move(split);
    }
    return best;
  }

  /// The piece's corners as the mesh itself has them.
  std::vector<Vector3d> exact_points(const Piece& piece) const {
    CutMesh part{{mesh_.vertices, mesh_.triangles}};
    for (const Plane& plane : piece.coarse.cuts) part = below(part, plane, closed_);
    return corners_of(part, mesh_);
  }

  static Piece joined(const Piece& a, const Piece& b) {
    Piece sum;
    sum.points = convex_hull(a.points).vertices;
    const std::vector<Vector3d> more = convex_hull(b.points).vertices;
    sum.points.insert(sum.points.end(), more.begin(), more.end());
    sum.hull = hull_volume(sum.points);
    return sum;
  }

  /// Joins the pair that adds least volume, while that is next to nothing or there are too many.
  void join() {
    while (pieces_.size() > 1) {
      double least = 1e300;
      std::size_t first = 0, second = 0;
      Piece best;
      for (std::size_t i = 0; i < pieces_.size(); ++i) {
        for (std::size_t k = i + 1; k < pieces_.size(); ++k) {
          if (!boxes_meet(pieces_[i], pieces_[k]) && pieces_.size() <= most_parts()) continue;
          Piece sum = joined(pieces_[i], pieces_[k]);
          const double added = sum.hull - pieces_[i].hull - pieces_[k].hull;
          if (added >= least) continue;
          least = added, first = i, second = k, best = std::move(sum);
        }
      }
      if (pieces_.size() <= most_parts() && least > 0.02 * options_.concavity * total_) return;
      pieces_[first] = std::move(best);
      pieces_.erase(pieces_.begin() + static_cast<std::ptrdiff_t>(second));
    }
  }
  std::size_t most_parts() const { return static_cast<std::size_t>(options_.most_parts); }

  bool boxes_meet(const Piece& a, const Piece& b) const {
    const Extent x = extent_of(a.points), y = extent_of(b.points);
    const double near = 1e-6 * extent_of(mesh_.vertices).size().norm();
    return ((x.high - y.low).array() > -near).all() && ((y.high - x.low).array() > -near).all();
  }

  const TriangleMesh& mesh_;
  const PartOptions& options_;
  const bool closed_;
  TriangleMesh coarse_;
  double total_ = 0;
  std::vector<Piece> pieces_;
};

}  // namespace

std::vector<TriangleMesh> convex_parts(const TriangleMesh& mesh, const PartOptions& options) {
  return Decomposition(mesh, options).parts();
}

}  // namespace flowscope
