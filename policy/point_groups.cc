#include "policy/point_groups.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "policy/farthest_points.h"
#include "policy/space_curve.h"

namespace flowscope {
namespace {

using Eigen::Vector3f;

int lowest(std::span<const Vector3f> position) {
  const auto before = [](const Vector3f& a, const Vector3f& b) {
    return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
  };
  return static_cast<int>(std::min_element(position.begin(), position.end(), before) - position.begin());
}

struct Near {
  float distance2;
  int index;
};

/// The points as separate arrays, which distances to many of them are quickly taken from.
class Surround {
 public:
  explicit Surround(std::span<const Vector3f> position) : count_(position.size()) {
    for (int k = 0; k < 3; ++k) {
      for (const Vector3f& p : position) place_[k].push_back(p[k]);
      place_[k].resize((count_ + kBlock - 1) / kBlock * kBlock, std::numeric_limits<float>::infinity());
    }
  }

  // The `size` points nearest to point `center`, sorted; of equally near ones the first. Points that stand
  // near mostly follow each other, so the search begins around `center` and finds little to exchange
  // elsewhere.
  std::vector<Near> nearest_to(std::size_t center, int size) const {
    const std::size_t blocks = place_[0].size() / kBlock, home = center / kBlock;
    std::vector<Near> nearest(static_cast<std::size_t>(size),
                              {std::numeric_limits<float>::infinity(), std::numeric_limits<int>::max()});
    search(home, center, nearest);
    for (std::size_t away = 1; away < blocks; ++away) {
      if (away <= home) search(home - away, center, nearest);
      if (home + away < blocks) search(home + away, center, nearest);
    }
    return nearest;
  }

 private:
  static constexpr std::size_t kBlock = 64;

  void search(std::size_t block, std::size_t center, std::vector<Near>& nearest) const {
    const std::size_t first = block * kBlock;
    const float *x = &place_[0][first], *y = &place_[1][first], *z = &place_[2][first];
    const float cx = place_[0][center], cy = place_[1][center], cz = place_[2][center];
    float distance2[kBlock], least = std::numeric_limits<float>::infinity();
#pragma omp simd reduction(min : least)
    for (std::size_t i = 0; i < kBlock; ++i) {
      const float dx = x[i] - cx, dy = y[i] - cy, dz = z[i] - cz;
      distance2[i] = dx * dx + dy * dy + dz * dz;
      least = std::min(least, distance2[i]);
    }
    if (least > nearest.back().distance2) return;
    const auto before = [](const Near& a, const Near& b) {
      return a.distance2 < b.distance2 || (a.distance2 == b.distance2 && a.index < b.index);
    };
    for (std::size_t i = 0; i < kBlock && first + i < count_; ++i) {
      const Near found{distance2[i], static_cast<int>(first + i)};
      if (!before(found, nearest.back())) continue;
      std::size_t at = nearest.size() - 1;
      for (; at > 0 && before(found, nearest[at - 1]); --at) nearest[at] = nearest[at - 1];
      nearest[at] = found;
    }
  }

  std::size_t count_;
  std::vector<float> place_[3];
};

CurveCube cube_around(std::span<const Vector3f> position) {
  Vector3f low = position[0], high = position[0];
  for (const Vector3f& p : position) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  return {low, std::max((high - low).maxCoeff(), 1e-6f)};
}

template <typename Code>
std::vector<int> order_along(const std::vector<CurveCell>& cell, Code code) {
  std::vector<std::pair<std::uint32_t, int>> keyed;
  for (std::size_t g = 0; g < cell.size(); ++g) keyed.emplace_back(code(cell[g]), static_cast<int>(g));
  std::sort(keyed.begin(), keyed.end());
  std::vector<int> order;
  for (const auto& [place, g] : keyed) order.push_back(g);
  return order;
}

}  // namespace

void on_this_thread(int count, const std::function<void(int first, int last)>& part) { part(0, count); }

PointGroups group_points(std::span<const Vector3f> position, int groups, int size,
                         const OverParts& over_parts) {
  const int n = static_cast<int>(position.size());
  if (groups < 1 || size < 1 || groups > n || size > n)
    throw std::invalid_argument("point groups: " + std::to_string(groups) + " groups of " +
                                std::to_string(size) + " wanted from " + std::to_string(n) + " points");
  PointGroups out;
  out.center = farthest_points({.position = position}, groups, lowest(position));
  const Surround surround(position);
  out.neighbour.resize(static_cast<std::size_t>(groups) * static_cast<std::size_t>(size));
  std::vector<float> reach_m(out.center.size());
  over_parts(groups, [&](int first, int last) {
    for (auto g = static_cast<std::size_t>(first); g < static_cast<std::size_t>(last); ++g) {
      const auto nearest = surround.nearest_to(static_cast<std::size_t>(out.center[g]), size);
      reach_m[g] = std::sqrt(nearest.back().distance2) / static_cast<float>(groups);
      for (std::size_t j = 0; j < nearest.size(); ++j)
        out.neighbour[g * nearest.size() + j] = nearest[j].index;
    }
  });
  for (const float reach : reach_m) out.reach_m += reach;

  const CurveCube cube = cube_around(position);
  std::vector<CurveCell> cell;
  for (const int c : out.center) cell.push_back(curve_cell(cube, position[static_cast<std::size_t>(c)]));
  out.hilbert = order_along(cell, [](const CurveCell& c) { return hilbert_code(c); });
  out.transposed_hilbert = order_along(cell, [](const CurveCell& c) { return transposed_hilbert_code(c); });
  return out;
}

}  // namespace flowscope
