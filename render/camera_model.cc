#include "render/camera_model.h"

#include <numbers>
#include <stdexcept>

namespace flowscope {

CameraModel OrbitCamera::model(int width, int height) const {
  if (width <= 0 || height <= 0)
    throw std::invalid_argument("orbit camera: width and height must be positive");
  if (!(distance_m > 0) || !(fovy_deg > 0 && fovy_deg < 180) || !std::isfinite(azimuth_deg) ||
      !std::isfinite(elevation_deg) || !lookat.allFinite()) {
    throw std::invalid_argument("orbit camera: needs distance > 0, 0 < fovy_deg < 180 and finite angles");
  }
  constexpr double radian = std::numbers::pi / 180;
  const double az = azimuth_deg * radian, el = elevation_deg * radian;
  // MuJoCo's free camera: azimuth 0 looks along world +x, a negative elevation looks down.
  const Eigen::Vector3d forward(std::cos(el) * std::cos(az), std::cos(el) * std::sin(az), std::sin(el));
  const Eigen::Vector3d right(std::sin(az), -std::cos(az), 0);
  Eigen::Matrix3d world_from_camera;
  world_from_camera << right, forward.cross(right), forward;
  const Pose pose{lookat - distance_m * forward, Eigen::Quaterniond(world_from_camera).normalized()};
  return CameraModel::from_vertical_fov("orbit", width, height, fovy_deg * radian, pose);
}

}  // namespace flowscope
