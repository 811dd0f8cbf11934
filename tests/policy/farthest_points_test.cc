// Farthest point sampling against the plain algorithm, choice by choice.
#include "policy/farthest_points.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numeric>

#include "policy/random.h"

namespace flowscope {
namespace {

using Eigen::Vector3f;

struct Cloud {
  std::vector<Vector3f> position, color;
  std::vector<float> salience;

  FarthestInput in_space() const { return {.position = position}; }
  FarthestInput in_color() const {
    return {.position = position, .color = color, .salience = salience, .color_weight = 0.04f};
  }
};

Vector3f random_point(Random& random) {
  Vector3f p;
  for (float& v : p) v = static_cast<float>(random.uniform(-0.5, 0.5));
  return p;
}

/// kind: random, clustered, planar, lattice (many equal distances), duplicate, line
Cloud cloud(const std::string& kind, int count) {
  Random random(11);
  Cloud c;
  for (int i = 0; i < count; ++i) {
    Vector3f p = random_point(random);
    if (kind == "clustered") p = 0.01f * p + (i % 7 == 0 ? Vector3f(3, 0, 0) : Vector3f(0, 0.1f, 0));
    if (kind == "planar") p.z() = 0.752f;
    if (kind == "lattice") p = 0.1f * (10 * p).array().round().matrix();
    if (kind == "duplicate" && i % 3 != 0) p = c.position[static_cast<std::size_t>(random.below(i))];
    if (kind == "line") p = Vector3f(p.x(), 0, 0);
    c.position.push_back(p);
    c.color.push_back(random_point(random) + Vector3f::Constant(0.5f));
    c.salience.push_back(p.z() > 0 ? 1.f : 0.004f);
  }
  return c;
}

float distance2(const FarthestInput& in, std::size_t i, std::size_t j) {
  const float place2 = (in.position[i] - in.position[j]).squaredNorm();
  return in.color.empty()
             ? place2
             : in.salience[i] * (place2 + in.color_weight * (in.color[i] - in.color[j]).squaredNorm());
}

/// The algorithm as it is written down: every distance anew after every choice.
std::vector<int> plain_farthest_points(const FarthestInput& in, int count, int first) {
  const std::size_t n = in.position.size();
  std::vector<float> nearest(n, std::numeric_limits<float>::max());
  std::vector<bool> taken(n, false);
  std::vector<int> chosen;
  for (auto next = static_cast<std::size_t>(first); static_cast<int>(chosen.size()) < count && next < n;) {
    chosen.push_back(static_cast<int>(next));
    taken[next] = true;
    const std::size_t last = next;
    next = n;
    for (std::size_t i = 0; i < n; ++i) {
      nearest[i] = std::min(nearest[i], distance2(in, i, last));
      if (!taken[i] && (next == n || nearest[i] > nearest[next])) next = i;
    }
  }
  return chosen;
}

/// Selection sort by distance.
std::vector<int> plain_farthest_order(const FarthestInput& in, std::size_t even) {
  const std::size_t n = in.position.size();
  std::vector<int> order(n);
  std::iota(order.begin(), order.end(), 0);
  std::vector<float> nearest(n, std::numeric_limits<float>::max());
  for (std::size_t front = 0; front + 1 < std::min(even, n); ++front) {
    std::size_t farthest = front + 1;
    for (std::size_t i = front + 1; i < n; ++i) {
      nearest[i] = std::min(nearest[i], distance2(in, static_cast<std::size_t>(order[i]),
                                                  static_cast<std::size_t>(order[front])));
      if (nearest[i] > nearest[farthest]) farthest = i;
    }
    std::swap(order[front + 1], order[farthest]);
    std::swap(nearest[front + 1], nearest[farthest]);
  }
  return order;
}

class FarthestPoints : public ::testing::TestWithParam<std::string> {};

TEST_P(FarthestPoints, AreThoseOfThePlainAlgorithm) {
  for (const int n : {1, 5, 64, 65, 3000}) {
    const Cloud c = cloud(GetParam(), n);
    for (const auto& in : {c.in_space(), c.in_color()}) {
      const int first = n / 2, count = std::min(n, 500);
      const std::vector<int> expected = plain_farthest_points(in, count, first);
      for (const PointKernels* kernels : supported_point_kernels())
        EXPECT_EQ(farthest_points(in, count, first, kernels), expected)
            << kernels->name << ", " << n << (in.color.empty() ? " points" : " coloured points");
    }
  }
}

TEST_P(FarthestPoints, OrderIsThatOfThePlainAlgorithm) {
  for (const int n : {1, 70, 2500}) {
    const Cloud c = cloud(GetParam(), n);
    for (const int even : {0, 1, 300, 5000})
      EXPECT_EQ(farthest_order(c.in_color(), even),
                plain_farthest_order(c.in_color(), static_cast<std::size_t>(even)))
          << even << " of " << n;
  }
}

INSTANTIATE_TEST_SUITE_P(Clouds, FarthestPoints,
                         ::testing::Values("random", "clustered", "planar", "lattice", "duplicate", "line"),
                         [](const auto& kind) { return kind.param; });

TEST(FarthestPointsCount, IsNeverAboveThePointsAndEachComesOnce) {
  const Cloud c = cloud("duplicate", 200);
  std::vector<int> all = farthest_points(c.in_space(), 1000);
  EXPECT_EQ(all.size(), 200u);
  std::sort(all.begin(), all.end());
  EXPECT_EQ(std::unique(all.begin(), all.end()), all.end());
  EXPECT_TRUE(farthest_points(c.in_space(), 0).empty());
}

TEST(FarthestPointsErrors, NameWhatIsWrong) {
  Cloud c = cloud("random", 10);
  EXPECT_THROW(farthest_points({}, 3), std::invalid_argument);
  EXPECT_THROW(farthest_points(c.in_space(), 3, 10), std::invalid_argument);
  EXPECT_THROW(farthest_points({.position = c.position, .color = c.color}, 3), std::invalid_argument);
  c.salience[4] = -1;
  EXPECT_THROW(farthest_points(c.in_color(), 3), std::invalid_argument);
  c.position[7].y() = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(farthest_points(c.in_space(), 3), std::invalid_argument);
}

}  // namespace
}  // namespace flowscope
