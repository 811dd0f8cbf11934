#include "recorder/mesh/convex_parts.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "recorder/mesh/convex_hull.h"
#include "recorder/mesh/cut_planes.h"
#include "recorder/mesh/cut_trial.h"
#include "recorder/mesh/hull_join.h"
#include "recorder/mesh/mesh_shells.h"
#include "recorder/mesh/mesh_simplify.h"

namespace flowscope {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kCoarse_triangles = 1500;
constexpr double kBalance = 0.03;    ///< how much an even cut is worth against volume saved
constexpr double kSheetGain = 0.01;  ///< an open mesh is cut while that saves this much of its hull
constexpr int kPatience = 3;         ///< cuts of an open mesh in a row that may save nothing
constexpr double kPeel = 0.05;       ///< what it is worth to cut something convex off, where parts are peeled
constexpr std::size_t kFlat_faced = 300;  ///< triangles; what has more is round
constexpr double kHair = 1e-6;            ///< so near a plane is on it; the shape's size is 1
constexpr double kAlike = 1e-4;           ///< no better than this is no better: ties fall alike at any scale

/// One closed surface, or the whole of an open mesh, and what stands for it in the search.
struct Shape {
  TriangleMesh exact, coarse;
  std::vector<Crease> creases;  ///< of the coarse one
  bool is_coarse = false;       ///< the two differ
};

struct Piece {
  std::size_t shape = 0;
  CutMesh coarse, exact;          ///< exact: only if it differs
  std::vector<Vector3d> inner{};  ///< corners where cuts meet inside the shape
  double volume = 0, hull = 0;
  bool stuck = false;  ///< no plane cuts it
};

struct Split {
  Plane plane;
  CutVolumes volumes;
  double score = 0;
};

std::size_t most_pieces(const PartOptions& options) {
  return options.most_parts > 1 ? static_cast<std::size_t>(2 * options.most_parts) : 1;
}

class Decomposition {
 public:
  Decomposition(const TriangleMesh& mesh, const PartOptions& options)
      : options_(options), closed_(is_closed(mesh)) {
    std::vector<TriangleMesh> shells;
    if (closed_) shells = shells_of(mesh, static_cast<std::size_t>(8 * options.most_parts));
    if (shells.empty()) shells.push_back(mesh);
    for (TriangleMesh& shell : shells) add_shape(std::move(shell), mesh.triangles.size());
    total_ = 1e-3 * hull_volume(mesh.vertices);
    double sum = 0;
    for (const Piece& piece : pieces_) sum += closed_ ? piece.volume : piece.hull;
    total_ = std::max(total_, sum);
  }

  /// `peel`: takes off what is convex as soon as it can; exact for flat faces, wasteful for round ones.
  std::vector<TriangleMesh> parts(bool peel, const std::function<void(int)>& progress) {
    peel_ = peel ? kPeel : 0;
    cut(progress);
    std::vector<std::vector<Vector3d>> corners;
    for (const Piece& piece : pieces_) corners.push_back(corners_of(piece));
    std::vector<TriangleMesh> result;
    for (const auto& points : joined_hulls(corners, static_cast<std::size_t>(options_.most_parts),
                                           0.02 * options_.concavity * total_)) {
      TriangleMesh hull = simple_hull(points, options_.most_corners);
      if (!hull.triangles.empty()) result.push_back(std::move(hull));
    }
    return result;
  }

 private:
  void add_shape(TriangleMesh shell, std::size_t all) {
    const std::size_t most = std::max<std::size_t>(200, kCoarse_triangles * shell.triangles.size() / all);
    Shape shape;
    shape.coarse = simplified(shell, most);
    shape.is_coarse = shape.coarse.triangles.size() < shell.triangles.size();
    shape.exact = std::move(shell);
    shape.creases = creases_of(shape.coarse);
    Piece piece;
    piece.shape = shapes_.size();
    piece.coarse.mesh = shape.coarse;
    if (shape.is_coarse) piece.exact.mesh = shape.exact;
    piece.volume = mass_properties(shape.coarse).volume;
    piece.hull = hull_volume(shape.coarse.vertices);
    shapes_.push_back(std::move(shape));
    pieces_.push_back(std::move(piece));
  }

  /// Of an open mesh: what there is to gain at most.
  double excess(const Piece& piece) const { return piece.hull - (closed_ ? piece.volume : 0); }

  /// Cuts the piece with most to gain until the whole is near enough, or there are enough pieces to join some
  /// again. That a cut gains nothing is no reason to stop: half a ring's hull still fills half its hole.
  void cut(const std::function<void(int)>& progress) {
    const std::size_t most = most_pieces(options_);
    for (int idle = 0; pieces_.size() < most && (closed_ || idle < kPatience);) {
      progress(static_cast<int>(pieces_.size()));
      double sum = 0;
      Piece* worst = nullptr;
      for (Piece& piece : pieces_) {
        sum += std::max(0.0, excess(piece));
        if (piece.stuck || excess(piece) <= kAlike * total_) continue;
        if (worst == nullptr || excess(piece) > excess(*worst) + kAlike * total_) worst = &piece;
      }
      if (worst == nullptr || (closed_ && sum <= options_.concavity * total_)) return;
      const auto split = best_split(*worst);
      if (!split) {
        worst->stuck = true;
        continue;
      }
      const double saved = worst->hull - split->volumes.low_hull - split->volumes.high_hull;
      idle = saved > kSheetGain * total_ ? 0 : idle + 1;
      Piece high = side(*worst, *split, false);
      *worst = side(*worst, *split, true);
      pieces_.push_back(std::move(high));
    }
  }

  std::optional<Split> best_split(const Piece& piece) const {
    std::optional<Split> best;
    const CutTrial trial(piece.coarse, piece.inner, shapes_[piece.shape].coarse, closed_);
    for (const Plane& plane : planes_to_try(piece.coarse, shapes_[piece.shape].creases)) {
      Split split{plane, trial.measure(plane)};
      const auto& [volume, low, high] = split.volumes;
      const double least = 1e-4 * piece.hull;
      if (low < least || high < least) continue;
      split.score = (low + high) / piece.hull + kBalance * std::abs(low - high) / (low + high);
      if (is_convex(low - volume) || is_convex(high - (piece.volume - volume))) split.score -= peel_;
      if (!best || split.score < best->score - kAlike) best = split;
    }
    return best;
  }

  bool is_convex(double excess) const {
    return closed_ && excess < 0.1 * options_.concavity * total_ / options_.most_parts;
  }

  Piece side(const Piece& piece, const Split& split, bool low) const {
    const Plane plane = low ? split.plane : split.plane.turned();
    const Shape& shape = shapes_[piece.shape];
    Piece half;
    half.shape = piece.shape;
    half.coarse = below(piece.coarse, plane, closed_);
    if (shape.is_coarse) half.exact = below(piece.exact, plane, false);
    for (const Vector3d& p : piece.inner)
      if (plane.normal.dot(p) < plane.offset + kHair) half.inner.push_back(p);
    if (closed_)
      for (const Vector3d& p : inner_corners(piece.coarse.cuts, plane, shape.coarse)) half.inner.push_back(p);
    half.volume = low ? split.volumes.low : piece.volume - split.volumes.low;
    half.hull = low ? split.volumes.low_hull : split.volumes.high_hull;
    return half;
  }

  std::vector<Vector3d> corners_of(const Piece& piece) const {
    std::vector<Vector3d> corners =
        surface_corners(shapes_[piece.shape].is_coarse ? piece.exact : piece.coarse);
    corners.insert(corners.end(), piece.inner.begin(), piece.inner.end());
    return corners;
  }

  const PartOptions& options_;
  const bool closed_;
  double total_ = 0, peel_ = 0;
  std::vector<Shape> shapes_;
  std::vector<Piece> pieces_;
};

double volume_of(const std::vector<TriangleMesh>& parts) {
  double sum = 0;
  for (const TriangleMesh& part : parts) sum += mass_properties(part).volume;
  return sum;
}

/// Fewer parts where both are near enough, less volume otherwise.
bool is_better(const std::vector<TriangleMesh>& parts, const std::vector<TriangleMesh>& than, double enough) {
  const double volume = volume_of(parts), other = volume_of(than);
  if (volume <= enough && other <= enough) return parts.size() < than.size();
  return volume < (1 - kAlike) * other;
}

/// Of two ways to cut the better one: which it is depends on the shape.
std::vector<TriangleMesh> best_parts(const TriangleMesh& mesh, const PartOptions& options) {
  const int most = static_cast<int>(most_pieces(options));
  const auto tell = [&](int before) {
    return [&options, before, most](int pieces) {
      if (options.progress) options.progress(before + pieces, 2 * most);
    };
  };
  Decomposition even(mesh, options);
  Decomposition peeling = even;
  std::vector<TriangleMesh> parts = even.parts(false, tell(0));
  if (parts.size() <= 2 || !is_closed(mesh) || mesh.triangles.size() > kFlat_faced) return parts;
  std::vector<TriangleMesh> peeled = peeling.parts(true, tell(most));
  const double enough = (1 + options.concavity) * mass_properties(mesh).volume;
  return is_better(peeled, parts, enough) ? peeled : parts;
}

}  // namespace

std::vector<TriangleMesh> convex_parts(const TriangleMesh& mesh, const PartOptions& options) {
  // A power of two of the mesh's size is the unit: every decision is the same at any scale.
  const Extent extent = extent_of(mesh.vertices);
  const double largest = extent.size().maxCoeff();
  if (!(largest > 0)) return {};
  const double unit = std::exp2(std::ceil(std::log2(largest)));
  const Vector3d middle = 0.5 * (extent.low + extent.high);
  TriangleMesh small{mesh.vertices, mesh.triangles};
  for (Vector3d& v : small.vertices) v = (v - middle) / unit;
  std::vector<TriangleMesh> parts = best_parts(small, options);
  for (TriangleMesh& part : parts)
    for (Vector3d& v : part.vertices) v = unit * v + middle;
  return parts;
}

}  // namespace flowscope
