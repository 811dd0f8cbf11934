#include "recorder/demo_pixels.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace flowscope {
namespace {

constexpr double finest_depth_m = 1e-4;
constexpr double max_count = 65535;

bool has_size_of(const CameraModel& camera, int width, int height, std::size_t values, int channels) {
  return camera.width >= 0 && camera.height >= 0 && width == camera.width && height == camera.height &&
         values == static_cast<std::size_t>(width) * height * channels;
}

void require_storable(const View& view) {
  const CameraModel& camera = view.camera;
  if (!has_size_of(camera, view.rgb.width, view.rgb.height, view.rgb.data.size(), 3) ||
      !has_size_of(camera, view.depth.width, view.depth.height, view.depth.data.size(), 1)) {
    throw std::invalid_argument("view " + camera.name + ": a picture does not have its camera's size");
  }
  if (!std::all_of(view.depth.data.begin(), view.depth.data.end(),
                   [](float z) { return std::isfinite(z) && z >= 0; })) {
    throw std::invalid_argument("view " + camera.name + ": depth is negative or not finite");
  }
  const Pose& pose = camera.world_from_camera;
  const Eigen::Matrix<double, 6, 1> lens(camera.fx, camera.fy, camera.cx, camera.cy, camera.near_m,
                                         camera.far_m);
  if (!lens.allFinite() || !pose.position.allFinite() || !pose.rotation.coeffs().allFinite()) {
    throw std::invalid_argument("view " + camera.name + ": the camera has a number that is not finite");
  }
}

/// Neighbouring depths are close, so their differences compress three times better than the depths.
Bytes depth_differences(const DepthImage& depth, double unit_m) {
  Bytes raw;
  raw.reserve(depth.data.size() * sizeof(std::uint16_t));
  std::uint16_t left = 0;
  for (const float z : depth.data) {
    const auto count = static_cast<std::uint16_t>(std::min(std::round(z / unit_m), max_count));
    put(raw, static_cast<std::uint16_t>(count - left));
    left = count;
  }
  return raw;
}

DepthImage depth_from_differences(std::span<const std::uint8_t> raw, int width, int height, double unit_m) {
  DepthImage depth(width, height);
  ByteReader reader(raw);
  std::uint16_t count = 0;
  for (float& z : depth.data) {
    count = static_cast<std::uint16_t>(count + reader.get<std::uint16_t>());
    z = static_cast<float>(count * unit_m);
  }
  return depth;
}

}  // namespace

std::vector<ViewLayout> describe_observation(const Observation& observation) {
  std::vector<ViewLayout> layouts;
  for (const View& view : observation.views) {
    require_storable(view);
    const auto farthest = std::max_element(view.depth.data.begin(), view.depth.data.end());
    ViewLayout& layout = layouts.emplace_back();
    layout.camera = view.camera;
    layout.depth_unit_m =
        farthest == view.depth.data.end() ? finest_depth_m : std::max(finest_depth_m, *farthest / max_count);
  }
  return layouts;
}

std::vector<ViewLayout> pack_observation(const Observation& observation, Bytes& blocks) {
  std::vector<ViewLayout> layouts = describe_observation(observation);
  for (std::size_t v = 0; v < layouts.size(); ++v) {
    const View& view = observation.views[v];
    const Bytes rgb = deflate_bytes(view.rgb.data);
    const Bytes depth = deflate_bytes(depth_differences(view.depth, layouts[v].depth_unit_m));
    layouts[v].rgb_bytes = rgb.size();
    layouts[v].depth_bytes = depth.size();
    blocks.insert(blocks.end(), rgb.begin(), rgb.end());
    blocks.insert(blocks.end(), depth.begin(), depth.end());
  }
  return layouts;
}

Observation unpack_observation(ByteReader& reader, const std::vector<ViewLayout>& layouts) {
  Observation observation;
  for (const ViewLayout& layout : layouts) {
    const int width = layout.camera.width, height = layout.camera.height;
    const std::size_t pixels = static_cast<std::size_t>(width) * height;
    View& view = observation.views.emplace_back();
    view.camera = layout.camera;
    view.rgb.width = width;
    view.rgb.height = height;
    view.rgb.data = inflate_bytes(reader.take(layout.rgb_bytes), pixels * 3);
    const Bytes raw = inflate_bytes(reader.take(layout.depth_bytes), pixels * sizeof(std::uint16_t));
    view.depth = depth_from_differences(raw, width, height, layout.depth_unit_m);
  }
  return observation;
}

}  // namespace flowscope
