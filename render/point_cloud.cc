#include <stdexcept>

#include "render/observation.h"

namespace flowscope {

namespace {

void check_sizes(const View& view) {
  const CameraModel& camera = view.camera;
  const std::size_t pixels = static_cast<std::size_t>(camera.width) * camera.height;
  const bool same_size = view.rgb.width == camera.width && view.rgb.height == camera.height &&
                         view.depth.width == camera.width && view.depth.height == camera.height;
  if (!same_size || view.rgb.data.size() != 3 * pixels || view.depth.data.size() != pixels) {
    throw std::invalid_argument("view '" + camera.name + "': colour, depth and camera differ in size");
  }
}

}  // namespace

PointCloud to_point_cloud(const Observation& observation, const Box& workspace) {
  PointCloud cloud;
  for (std::size_t v = 0; v < observation.views.size(); ++v) {
    const View& view = observation.views[v];
    check_sizes(view);
    const CameraModel& camera = view.camera;
    const Eigen::Matrix3d rotation = camera.world_from_camera.rotation.toRotationMatrix();
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const double z = view.depth.at(x, y);
        if (!(z > 0) || !std::isfinite(z)) continue;
        const Eigen::Vector3d p_camera((x + 0.5 - camera.cx) / camera.fx * z,
                                       (y + 0.5 - camera.cy) / camera.fy * z, z);
        const Eigen::Vector3d p_world = camera.world_from_camera.position + rotation * p_camera;
        if (!workspace.contains(p_world)) continue;
        const std::uint8_t* rgb = view.rgb.at(x, y);
        cloud.position.push_back(p_world.cast<float>());
        cloud.color.push_back(Eigen::Vector3f(rgb[0], rgb[1], rgb[2]) / 255.0f);
        cloud.view.push_back(static_cast<int>(v));
        cloud.pixel.push_back(y * camera.width + x);
      }
    }
  }
  return cloud;
}

}  // namespace flowscope
