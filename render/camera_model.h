// Pinhole camera: intrinsics travel with the pose and the picture size they belong to.
#pragma once

#include <cmath>
#include <string>

#include "render/pose.h"

namespace flowscope {

/// Camera axes as in OpenCV: x right, y down, z forward. Pixel centres at integer + 0.5.
struct CameraModel {
  std::string name;
  int width = 0, height = 0;         ///< pixels
  double fx = 0, fy = 0;             ///< focal lengths, pixels, positive
  double cx = 0, cy = 0;             ///< principal point, pixels
  double near_m = 0.01, far_m = 10;  ///< clip distances along z, metres
  Pose world_from_camera;

  static CameraModel from_vertical_fov(std::string name, int width, int height, double fovy_rad,
                                       const Pose& world_from_camera) {
    CameraModel c;
    c.name = std::move(name);
    c.width = width;
    c.height = height;
    c.fx = c.fy = 0.5 * height / std::tan(0.5 * fovy_rad);
    c.cx = 0.5 * width;
    c.cy = 0.5 * height;
    c.world_from_camera = world_from_camera;
    return c;
  }
  double fovy_rad() const { return 2 * std::atan(0.5 * height / fy); }

  /// Pixel (u, v) and depth z (metres) of a world point. z <= 0: behind the camera, u and v mean nothing.
  Eigen::Vector3d project(const Eigen::Vector3d& p_world) const {
    const Eigen::Vector3d p = world_from_camera.inverse() * p_world;
    return {fx * p.x() / p.z() + cx, fy * p.y() / p.z() + cy, p.z()};
  }
  /// World point seen at pixel position (u, v) with depth z (metres).
  Eigen::Vector3d unproject(double u, double v, double z) const {
    return world_from_camera * Eigen::Vector3d((u - cx) / fx * z, (v - cy) / fy * z, z);
  }
  bool operator==(const CameraModel&) const = default;
};

/// A free view around a point, with MuJoCo's angles: azimuth about world z, elevation negative looks down.
struct OrbitCamera {
  double azimuth_deg = 150, elevation_deg = -25, distance_m = 1.6;
  Eigen::Vector3d lookat{0.15, 0.0, 0.95};  ///< metres, world
  double fovy_deg = 45;

  CameraModel model(int width, int height) const;
  bool operator==(const OrbitCamera&) const = default;
};

}  // namespace flowscope
