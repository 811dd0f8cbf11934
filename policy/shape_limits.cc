#include "policy/shape_limits.h"

#include <map>
#include <stdexcept>

#include "policy/preset_fields.h"

namespace flowscope {
namespace {

struct Limits {
  int low, high;
};

const std::map<std::string, Limits>& limits() {
  static const std::map<std::string, Limits> known{
      {"channels", {1, 4096}},      {"d_state", {1, 256}},         {"prefix_blocks", {0, 64}},
      {"point_blocks", {0, 64}},    {"fusion_blocks", {0, 64}},    {"velocity_blocks", {0, 64}},
      {"heads", {1, 64}},           {"words", {1, 1024}},          {"vocabulary", {4, 65536}},
      {"image_tokens", {1, 65536}}, {"region_points", {1, 65536}}, {"scene_points", {1, 1 << 20}},
      {"point_groups", {0, 65536}}, {"group_size", {1, 1024}}};
  return known;
}

}  // namespace

void require_sane(const NetworkShape& shape) {
  const auto check = [](const char* name, const auto& value) {
    if constexpr (std::is_same_v<std::remove_cvref_t<decltype(value)>, int>) {
      const auto [low, high] = limits().at(name);
      if (value < low || value > high)
        throw std::invalid_argument(std::string(name) + " " + std::to_string(value) + " is not from " +
                                    std::to_string(low) + " to " + std::to_string(high));
    }
  };
  visit_shape(shape, check);
  visit_later_shape(shape, check);
  if (shape.point_groups > shape.region_points)
    throw std::invalid_argument("point_groups exceed region_points");
  if (shape.voxel_m != 0 && !(shape.voxel_m >= 1e-4))
    throw std::invalid_argument("voxel_m is neither 0 nor at least 0.1 mm");
}

}  // namespace flowscope
