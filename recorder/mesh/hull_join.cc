#include "recorder/mesh/hull_join.h"

#include <algorithm>

#include "recorder/mesh/convex_hull.h"

namespace flowscope {
namespace {

using Eigen::Vector3d;

struct Hull {
  std::vector<Vector3d> corners;
  double volume = 0;
  Extent extent;
};

Hull hull_of(const std::vector<Vector3d>& points) {
  Hull hull;
  const TriangleMesh mesh = convex_hull(points);
  hull.volume = mass_properties(mesh).volume;
  hull.extent = extent_of(mesh.vertices);
  hull.corners = mesh.vertices;
  return hull;
}

std::vector<Vector3d> both(const Hull& a, const Hull& b) {
  std::vector<Vector3d> points = a.corners;
  points.insert(points.end(), b.corners.begin(), b.corners.end());
  return points;
}

class Joining {
 public:
  Joining(const std::vector<std::vector<Vector3d>>& parts, std::size_t most, double little)
      : most_(most), little_(little) {
    std::vector<Vector3d> all;
    for (const auto& points : parts) {
      Hull hull = hull_of(points);
      if (hull.volume <= 0) continue;
      all.push_back(hull.extent.low), all.push_back(hull.extent.high);
      hulls_.push_back(std::move(hull));
    }
    near_ = 1e-6 * extent_of(all).size().norm();
    added_.assign(hulls_.size(), std::vector<double>(hulls_.size(), kUnknown));
  }

  std::vector<std::vector<Vector3d>> join() {
    while (hulls_.size() > 1) {
      const bool too_many = hulls_.size() > most_;
      double least = 1e300;
      std::size_t first = 0, second = 0;
      for (std::size_t i = 0; i < hulls_.size(); ++i) {
        for (std::size_t k = i + 1; k < hulls_.size(); ++k) {
          if (!too_many && !boxes_meet(hulls_[i], hulls_[k])) continue;
          if (added(i, k) >= least - 1e-3 * little_) continue;  // ties go to the first
          least = added(i, k), first = i, second = k;
        }
      }
      if (!too_many && least > little_) break;
      put_together(first, second);
    }
    std::vector<std::vector<Vector3d>> result;
    for (Hull& hull : hulls_) result.push_back(std::move(hull.corners));
    return result;
  }

 private:
  static constexpr double kUnknown = -1e300;

  /// Volume that the hull of both has more than the two.
  double added(std::size_t i, std::size_t k) {
    double& known = added_[i][k];
    if (known == kUnknown)
      known = hull_volume(both(hulls_[i], hulls_[k])) - hulls_[i].volume - hulls_[k].volume;
    return known;
  }

  void put_together(std::size_t first, std::size_t second) {
    hulls_[first] = hull_of(both(hulls_[first], hulls_[second]));
    hulls_.erase(hulls_.begin() + static_cast<std::ptrdiff_t>(second));
    added_.erase(added_.begin() + static_cast<std::ptrdiff_t>(second));
    for (auto& row : added_) row.erase(row.begin() + static_cast<std::ptrdiff_t>(second));
    std::ranges::fill(added_[first], kUnknown);
    for (auto& row : added_) row[first] = kUnknown;
  }

  bool boxes_meet(const Hull& a, const Hull& b) const {
    return ((a.extent.high - b.extent.low).array() > -near_).all() &&
           ((b.extent.high - a.extent.low).array() > -near_).all();
  }

  std::size_t most_;
  double little_, near_ = 0;
  std::vector<Hull> hulls_;
  std::vector<std::vector<double>> added_;  ///< by pair, the lower index first
};

}  // namespace

std::vector<std::vector<Vector3d>> joined_hulls(const std::vector<std::vector<Vector3d>>& parts,
                                                std::size_t most, double little) {
  return Joining(parts, most, little).join();
}

}  // namespace flowscope
