// A box around a geom that stands still: what rules out most pairs of geoms before anybody asks exactly.
#pragma once

#include <Eigen/Core>

struct mjModel_;
struct mjData_;

namespace flowscope {

struct GeomBounds {
  Eigen::Vector3d low, high;     ///< metres, along the world's axes; infinite for what has no end
  Eigen::Vector3d center, half;  ///< metres, along the box's own axes
  Eigen::Matrix3d world_from_box;

  /// Whether a sphere may reach in. False is certain, true is not.
  bool within(const Eigen::Vector3d& sphere_center, double radius) const {
    for (int i = 0; i < 3; ++i) {
      if (sphere_center[i] + radius < low[i] || sphere_center[i] - radius > high[i]) return false;
    }
    const Eigen::Vector3d offset = world_from_box.transpose() * (sphere_center - center);
    return (offset.cwiseAbs() - half).cwiseMax(0).squaredNorm() <= radius * radius;
  }
};

/// Of a geom where `data` has it (geom_xpos, geom_xmat up to date).
GeomBounds geom_bounds(const mjModel_* model, const mjData_* data, int geom);

}  // namespace flowscope
