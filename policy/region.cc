#include "policy/region.h"

#include <algorithm>
#include <cstdint>
#include <stdexcept>
#include <utility>

#include "policy/farthest_points.h"
#include "policy/space_curve.h"

namespace flowscope {
namespace {

using Eigen::Vector3f;

const Vector3f& place(const std::vector<ScenePoint>& points, int i) {
  return points[static_cast<std::size_t>(i)].position;
}

std::vector<int> farthest_of(const std::vector<ScenePoint>& points, const std::vector<int>& inside,
                             int count) {
  std::vector<Vector3f> position;
  position.reserve(inside.size());
  for (const int i : inside) position.push_back(place(points, i));
  std::vector<int> chosen = farthest_points({.position = position}, count);
  for (int& i : chosen) i = inside[static_cast<std::size_t>(i)];
  return chosen;
}

// The nearest points outside, in turn; where there are none, those inside again.
void pad(RegionPoints& region, std::vector<std::pair<float, int>> outside, std::size_t count) {
  const std::size_t missing = count - region.index.size(), near = std::min(missing, outside.size());
  std::partial_sort(outside.begin(), outside.begin() + static_cast<std::ptrdiff_t>(near), outside.end());
  for (std::size_t i = 0; i < missing; ++i) {
    region.index.push_back(near > 0 ? outside[i % near].second : region.index[i]);
    region.inside.push_back(0);
  }
}

RegionPoints along_curve(const RegionPoints& region, const std::vector<ScenePoint>& points,
                         const CurveCube& cube) {
  std::vector<std::pair<std::uint32_t, std::size_t>> order;
  for (std::size_t i = 0; i < region.index.size(); ++i)
    order.emplace_back(morton_code(curve_cell(cube, place(points, region.index[i]))), i);
  std::sort(order.begin(), order.end());
  RegionPoints sorted{{}, {}, region.points_inside};
  for (const auto& [code, i] : order) {
    sorted.index.push_back(region.index[i]);
    sorted.inside.push_back(region.inside[i]);
  }
  return sorted;
}

}  // namespace

SphereRule sphere_rule(const NetworkShape& shape) {
  return shape.scene_points > scene_order_points ? SphereRule::farthest : SphereRule::scene_order;
}

RegionPoints select_region(const std::vector<ScenePoint>& points, const Vector3f& center, float radius_m,
                           int count, bool everywhere, SphereRule rule) {
  if (points.empty()) throw std::invalid_argument("the scene has no points");
  RegionPoints region;
  std::vector<std::pair<float, int>> outside;
  const float limit2 = radius_m * radius_m;
  for (int i = 0; i < static_cast<int>(points.size()); ++i) {
    const float d2 = (place(points, i) - center).squaredNorm();
    if (everywhere || d2 <= limit2) {
      if (++region.points_inside <= count || rule == SphereRule::farthest) region.index.push_back(i);
    } else if (region.points_inside < count) {
      outside.emplace_back(d2, i);
    }
  }
  if (region.points_inside > count && rule == SphereRule::farthest)
    region.index = farthest_of(points, region.index, count);
  region.inside.assign(region.index.size(), 1);
  pad(region, std::move(outside), static_cast<std::size_t>(count));
  return along_curve(region, points, {center - Vector3f::Constant(radius_m), 2 * radius_m});
}

}  // namespace flowscope
