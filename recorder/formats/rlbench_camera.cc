#include "recorder/formats/rlbench_camera.h"

#include <algorithm>
#include <cmath>

#include "recorder/formats/demo_arrays.h"

namespace flowscope {
namespace {

constexpr std::uint32_t max_count = (1u << 24) - 1;

}  // namespace

Eigen::Matrix3d rlbench_intrinsics(const CameraModel& camera) {
  Eigen::Matrix3d k;
  k << -camera.fx, 0, camera.cx - 0.5, 0, -camera.fy, camera.cy - 0.5, 0, 0, 1;
  return k;
}

Eigen::Matrix4d rlbench_extrinsics(const CameraModel& camera) {
  return matrix_of(camera.world_from_camera) * Eigen::Vector4d(-1, -1, 1, 1).asDiagonal();
}

ImageRgb pack_rlbench_depth(const DepthImage& depth, const CameraModel& camera) {
  ImageRgb packed(depth.width, depth.height);
  const double range = camera.far_m - camera.near_m;
  std::uint8_t* out = packed.data.data();
  for (const float z : depth.data) {
    const double part = std::clamp((z - camera.near_m) / range, 0.0, 1.0);
    const std::uint32_t count =
        z > 0 ? std::min(static_cast<std::uint32_t>(std::lround(part * max_count)), max_count - 1)
              : max_count;
    *out++ = static_cast<std::uint8_t>(count >> 16);
    *out++ = static_cast<std::uint8_t>(count >> 8);
    *out++ = static_cast<std::uint8_t>(count);
  }
  return packed;
}

DepthImage unpack_rlbench_depth(const ImageRgb& packed, const CameraModel& camera) {
  DepthImage depth(packed.width, packed.height);
  const double range = camera.far_m - camera.near_m;
  const std::uint8_t* in = packed.data.data();
  for (float& z : depth.data) {
    const std::uint32_t count = (std::uint32_t{in[0]} << 16) | (std::uint32_t{in[1]} << 8) | in[2];
    z = count == max_count ? 0 : static_cast<float>(camera.near_m + count * (range / max_count));
    in += 3;
  }
  return depth;
}

}  // namespace flowscope
