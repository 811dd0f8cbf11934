#include "policy/part_middles.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>

#include "policy/random.h"

namespace flowscope {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

Vector3f placed(float along, float across, float z, float yaw, const Vector3f& base) {
  const float c = std::cos(yaw), s = std::sin(yaw);
  return base + Vector3f(c * along - s * across, s * along + c * across, z);
}

/// A peg of 25 x 25 x 120 mm as cameras on one side of it see it: the top, and two of its four sides.
std::vector<Vector3f> half_seen_peg(float yaw, const Vector3f& base) {
  std::vector<Vector3f> points;
  for (int i = 0; i <= 5; ++i) {
    const float at = -0.0125f + 0.005f * static_cast<float>(i);
    for (int j = 0; j <= 5; ++j)
      points.push_back(placed(at, -0.0125f + 0.005f * static_cast<float>(j), 0.12f, yaw, base));
    for (int k = 0; k < 24; ++k) {
      const float z = 0.005f * static_cast<float>(k);
      points.push_back(placed(at, -0.0125f, z, yaw, base));
      points.push_back(placed(0.0125f, at, z, yaw, base));
    }
  }
  return points;
}

std::vector<Surroundings> centred(const std::vector<Vector3f>& points, const std::vector<int>& part) {
  std::vector<Surroundings> around(points.size());
  center_small_parts(points, part, around);
  return around;
}

TEST(PartMiddles, StandInTheAxisOfAPegSeenFromOneSide) {
  for (const float yaw : {-0.5f, 0.f, 0.3f, 0.7f}) {
    const Vector3f base(0.2f, -0.1f, 0.76f);
    const auto points = half_seen_peg(yaw, base);
    Vector3f mean = Vector3f::Zero();
    for (const Vector3f& p : points) mean += p / static_cast<float>(points.size());
    ASSERT_GT((mean - base).head<2>().norm(), 0.005f) << "what a mean would be wrong by";
    for (const Surroundings& s : centred(points, std::vector<int>(points.size(), 0))) {
      EXPECT_LT((s.middle - (base + Vector3f(0, 0, 0.06f))).norm(), 1e-4f);
      const double corner = std::atan2(s.square.y(), s.square.x()) / 4 + std::numbers::pi / 4;
      EXPECT_NEAR(std::remainder(corner - yaw, std::numbers::pi / 2), 0, 0.01);
      EXPECT_GT(s.square.norm(), 0.05f);
      EXPECT_LT(s.bar.norm(), 0.01f) << "no side is longer";
      EXPECT_EQ(s.neighbours, static_cast<int>(points.size()));
    }
  }
}

TEST(PartMiddles, LeaveLargePartsLinesAndLoosePointsAlone) {
  std::vector<Vector3f> points = half_seen_peg(0, {0, 0, 0.76f});
  std::vector<int> part(points.size(), 0);
  const std::size_t small = points.size();
  for (int i = 0; i < 20; ++i) {  // a plate of 20 cm, an upright line, and points of no part
    points.push_back({0.01f * static_cast<float>(i), i % 2 == 0 ? 0.1f : 0.2f, 0.76f});
    part.push_back(1);
    points.push_back({0.3f, 0.3f, 0.76f + 0.004f * static_cast<float>(i)});
    part.push_back(2);
    points.push_back({-0.3f, 0.01f * static_cast<float>(i), 0.76f});
    part.push_back(-1);
  }
  const auto around = centred(points, part);
  for (std::size_t i = 0; i < points.size(); ++i)
    EXPECT_EQ(around[i].neighbours > 0, i < small) << "point " << i << " of part " << part[i];
}

TEST(PartMiddles, TurnAndShiftWithTheScene) {
  const float yaw = 0.4f;
  const auto still = half_seen_peg(0.1f, {0, 0, 0.76f}), turned = half_seen_peg(0.5f, {0.05f, -0.02f, 0.77f});
  const std::vector<int> part(still.size(), 0);
  const Surroundings before = moved(centred(still, part).front(), yaw, {0.05f, -0.02f, 0.01f});
  const Surroundings after = centred(turned, part).front();
  EXPECT_LT((before.middle - after.middle).norm(), 1e-5f);
  // Points along an edge part it otherwise after a turn, and the moments are integrated edge by edge.
  EXPECT_LT((before.square - after.square).norm(), 5e-3f);
  EXPECT_LT((before.bar - after.bar).norm(), 1e-3f);
}

/// The moments as they are defined: sums over a fine grid of the area.
TEST(PartMiddles, HaveTheMomentsOfTheirArea) {
  Random random(3);
  for (int shape = 0; shape < 5; ++shape) {
    std::vector<Vector3f> corners;
    for (int i = 0; i < 7; ++i) {
      const double angle = 2 * std::numbers::pi * (i + random.uniform(0, 0.4)) / 7;
      corners.push_back({static_cast<float>(0.030 * std::cos(angle)),
                         static_cast<float>(random.uniform(0.012, 0.030) * std::sin(angle)), 0.8f});
    }
    const Surroundings seen = centred(corners, std::vector<int>(corners.size(), 0)).front();
    ASSERT_GT(seen.neighbours, 0);
    // Convex, so a place is inside when no line between two corners has all corners on its other side.
    const auto inside = [&](const Vector2f& p) {
      for (const Vector3f& a : corners)
        for (const Vector3f& b : corners) {
          const Vector2f side = (b - a).head<2>();
          const auto left = [&](const Vector2f& q) {
            const Vector2f d = q - a.head<2>();
            return side.x() * d.y() - side.y() * d.x();
          };
          bool edge = side.norm() > 0;
          for (const Vector3f& c : corners) edge = edge && left(c.head<2>()) >= -1e-9f;
          if (edge && left(p) < 0) return false;
        }
      return true;
    };
    std::vector<Vector2f> area;
    for (float x = -0.031f; x < 0.031f; x += 0.0005f)
      for (float y = -0.031f; y < 0.031f; y += 0.0005f)
        if (inside({x, y})) area.push_back({x, y});
    Vector2f middle = Vector2f::Zero();
    for (const Vector2f& p : area) middle += p / static_cast<float>(area.size());
    std::complex<double> square = 0, bar = 0;
    double total = 0;
    for (const Vector2f& p : area) {
      const std::complex<double> z(p.x() - middle.x(), p.y() - middle.y());
      square += std::norm(z) > 0 ? z * z * z * z / std::norm(z) : 0;
      bar += z * z;
      total += std::norm(z);
    }
    EXPECT_LT((seen.middle.head<2>() - middle).norm(), 3e-4f);
    EXPECT_NEAR(seen.square.x(), square.real() / total, 0.02);
    EXPECT_NEAR(seen.square.y(), square.imag() / total, 0.02);
    EXPECT_NEAR(seen.bar.x(), bar.real() / total, 0.02);
    EXPECT_NEAR(seen.bar.y(), bar.imag() / total, 0.02);
  }
}

TEST(PartMiddles, CountAsASampleOfTheUsualSizeWould) {
  std::vector<Vector3f> points;
  for (std::size_t i = 0; i < 2 * surroundings_sample; ++i)
    points.push_back(half_seen_peg(0, {i % 2 == 0 ? 0.f : 0.2f, 0, 0.76f})[i / 2 % 300]);
  std::vector<int> part;
  for (std::size_t i = 0; i < points.size(); ++i) part.push_back(static_cast<int>(i % 2));
  for (const Surroundings& s : centred(points, part))
    EXPECT_EQ(s.neighbours, static_cast<int>(surroundings_sample / 2));
}

}  // namespace
}  // namespace flowscope
