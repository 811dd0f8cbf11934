#include "recorder/convex_gap.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace flowscope {
namespace {

using Eigen::Vector3d;

constexpr double kTolerance_m = 1e-6;
constexpr int kMostRounds = 200;

/// The point of a simplex nearest to the origin, and the corners that it is a mixture of.
struct Nearest {
  Vector3d point{0, 0, 0};
  std::vector<Vector3d> corners;
};

// Small enough to need no memory of their own.
using Weights = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 4, 1>;
using Edges = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 3>;

/// Weights that make the least combination of `corners` with sum 1; false where corners are dependent.
bool least_combination(const std::vector<Vector3d>& corners, Weights& weights) {
  const auto n = static_cast<Eigen::Index>(corners.size());
  weights = Weights::Ones(n);
  if (n == 1) return true;
  Edges edges(3, n - 1);
  for (Eigen::Index i = 1; i < n; ++i) edges.col(i - 1) = corners[static_cast<std::size_t>(i)] - corners[0];
  const Eigen::ColPivHouseholderQR<Edges> solver(edges);
  if (solver.rank() < n - 1) return false;
  const Weights along = solver.solve(-corners[0]);
  weights.tail(n - 1) = along;
  weights[0] = 1 - along.sum();
  return true;
}

/// At most 15 parts of a tetrahedron: all are tried, which leaves no case to get wrong.
Nearest nearest_to_origin(const std::vector<Vector3d>& simplex) {
  Nearest best;
  double least = std::numeric_limits<double>::infinity();
  for (unsigned mask = 1; mask < (1u << simplex.size()); ++mask) {
    std::vector<Vector3d> corners;
    for (std::size_t i = 0; i < simplex.size(); ++i)
      if (mask >> i & 1) corners.push_back(simplex[i]);
    Weights weights;
    if (!least_combination(corners, weights) || weights.minCoeff() < 0) continue;
    Vector3d point = Vector3d::Zero();
    for (std::size_t i = 0; i < corners.size(); ++i)
      point += weights[static_cast<Eigen::Index>(i)] * corners[i];
    if (corners.size() == 4) point.setZero();  // inside a tetrahedron: rounding must not hide it
    if (point.norm() < least) {
      least = point.norm();
      best = {point, std::move(corners)};
    }
  }
  return best;
}

struct Face {
  std::array<std::size_t, 3> corner;
  Vector3d normal{0, 0, 0};  ///< outwards
  double distance = 0;       ///< of its plane from the origin
};

class Polytope {
 public:
  Polytope(std::vector<Vector3d> tetrahedron, const Support& difference)
      : corners_(std::move(tetrahedron)), difference_(difference) {
    middle_ = (corners_[0] + corners_[1] + corners_[2] + corners_[3]) / 4;
    for (const auto& f : {std::array<std::size_t, 3>{0, 1, 2}, {0, 1, 3}, {0, 2, 3}, {1, 2, 3}}) add(f);
  }

  double depth() {
    double best = 0;
    for (int round = 0; round < kMostRounds && !faces_.empty(); ++round) {
      const Face nearest = *std::ranges::min_element(faces_, {}, &Face::distance);
      best = nearest.distance;
      const Vector3d point = difference_(nearest.normal);
      if (point.dot(nearest.normal) - best < kTolerance_m) break;
      expand(point);
    }
    return std::max(0.0, best);
  }

 private:
  void add(std::array<std::size_t, 3> corner) {
    Face face{corner};
    const Vector3d &a = corners_[corner[0]], &b = corners_[corner[1]], &c = corners_[corner[2]];
    const Vector3d normal = (b - a).cross(c - a);
    if (normal.norm() < 1e-18) return;
    face.normal = normal.normalized();
    if (face.normal.dot(a - middle_) < 0) face.normal = -face.normal;
    face.distance = face.normal.dot(a);
    faces_.push_back(face);
  }

  /// Replaces the faces that see `point` by a fan from it to the edge of what they covered.
  void expand(const Vector3d& point) {
    std::vector<std::array<std::size_t, 2>> rim;
    const auto toggle = [&](std::size_t from, std::size_t to) {
      const std::array<std::size_t, 2> edge{std::min(from, to), std::max(from, to)};
      const auto found = std::ranges::find(rim, edge);
      found == rim.end() ? rim.push_back(edge) : void(rim.erase(found));
    };
    std::erase_if(faces_, [&](const Face& face) {
      if (face.normal.dot(point) - face.distance <= 1e-12) return false;
      for (int i = 0; i < 3; ++i) toggle(face.corner[i], face.corner[(i + 1) % 3]);
      return true;
    });
    corners_.push_back(point);
    for (const auto& [from, to] : rim) add({from, to, corners_.size() - 1});
  }

  std::vector<Vector3d> corners_;
  const Support& difference_;
  Vector3d middle_{0, 0, 0};
  std::vector<Face> faces_;
};

/// Adds points of the set until the simplex has volume; false when the set has none.
bool grow_to_tetrahedron(std::vector<Vector3d>& simplex, const Support& difference) {
  while (simplex.size() < 4) {
    std::vector<Vector3d> directions;
    if (simplex.size() == 1) {
      directions = {Vector3d::UnitX(), Vector3d::UnitY(), Vector3d::UnitZ()};
    } else if (simplex.size() == 2) {
      const Vector3d edge = simplex[1] - simplex[0], side = edge.unitOrthogonal();
      directions = {side, edge.cross(side)};
    } else {
      directions = {(simplex[1] - simplex[0]).cross(simplex[2] - simplex[0])};
    }
    const std::size_t before = simplex.size();
    for (const Vector3d& direction : directions) {
      for (const double sign : {1.0, -1.0}) {
        if (simplex.size() > before) break;
        const Vector3d axis = sign * direction.normalized(), point = difference(axis);
        if (std::abs(axis.dot(point - simplex[0])) > 1e-9) simplex.push_back(point);
      }
    }
    if (simplex.size() == before) return false;
  }
  return true;
}

}  // namespace

double convex_gap(const Support& first, const Support& second) {
  const Support difference = [&](const Vector3d& d) -> Vector3d { return first(d) - second(-d); };
  Nearest nearest;
  nearest.point = difference(Vector3d::UnitX());
  nearest.corners = {nearest.point};
  for (int round = 0; round < kMostRounds; ++round) {
    const double distance = nearest.point.norm();
    if (distance < 1e-9) {
      if (!grow_to_tetrahedron(nearest.corners, difference)) return 0;
      return -Polytope(nearest.corners, difference).depth();
    }
    const Vector3d point = difference(-nearest.point);
    if (distance - point.dot(nearest.point) / distance < kTolerance_m) return distance;
    std::vector<Vector3d> simplex = nearest.corners;
    simplex.push_back(point);
    Nearest next = nearest_to_origin(simplex);
    if (next.corners.empty() || next.point.norm() >= distance)
      return distance;  // as near as rounding lets it
    nearest = std::move(next);
  }
  return nearest.point.norm();
}

}  // namespace flowscope
