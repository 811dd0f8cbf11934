#include "policy/region.h"

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <stdexcept>
#include <utility>

namespace flowscope {
namespace {

// Bits of 10-bit numbers, two zeros between each.
std::uint32_t spread(std::uint32_t v) {
  v = (v | v << 16) & 0x030000FF;
  v = (v | v << 8) & 0x0300F00F;
  v = (v | v << 4) & 0x030C30C3;
  return (v | v << 2) & 0x09249249;
}

std::uint32_t morton(const Eigen::Vector3f& p, const Eigen::Vector3f& low, float side) {
  const Eigen::Vector3f u = ((p - low) / side * 1023.f).cwiseMax(0.f).cwiseMin(1023.f);
  return spread(static_cast<std::uint32_t>(u.x())) | spread(static_cast<std::uint32_t>(u.y())) << 1 |
         spread(static_cast<std::uint32_t>(u.z())) << 2;
}

}  // namespace

RegionPoints select_region(const std::vector<ScenePoint>& points, const Eigen::Vector3f& center,
                           float radius_m, int count, bool everywhere) {
  if (points.empty()) throw std::invalid_argument("the scene has no points");
  RegionPoints region;
  std::vector<std::pair<float, int>> outside;
  const float limit2 = radius_m * radius_m;
  for (int i = 0; i < static_cast<int>(points.size()); ++i) {
    const float d2 = (points[static_cast<std::size_t>(i)].position - center).squaredNorm();
    if (everywhere || d2 <= limit2) {
      if (++region.points_inside <= count) region.index.push_back(i);
    } else if (region.points_inside < count) {
      outside.emplace_back(d2, i);
    }
  }
  region.inside.assign(region.index.size(), 1);
  const std::size_t missing = static_cast<std::size_t>(count) - region.index.size();
  const std::size_t near = std::min(missing, outside.size());
  std::partial_sort(outside.begin(), outside.begin() + static_cast<std::ptrdiff_t>(near), outside.end());
  for (std::size_t i = 0; i < missing; ++i) {
    region.index.push_back(near > 0 ? outside[i % near].second : region.index[i]);
    region.inside.push_back(0);
  }

  const Eigen::Vector3f low = center - Eigen::Vector3f::Constant(radius_m);
  std::vector<std::pair<std::uint32_t, std::size_t>> order;
  for (std::size_t i = 0; i < region.index.size(); ++i)
    order.emplace_back(morton(points[static_cast<std::size_t>(region.index[i])].position, low, 2 * radius_m),
                       i);
  std::sort(order.begin(), order.end());
  RegionPoints sorted{{}, {}, region.points_inside};
  for (const auto& [code, i] : order) {
    sorted.index.push_back(region.index[i]);
    sorted.inside.push_back(region.inside[i]);
  }
  return sorted;
}

}  // namespace flowscope
