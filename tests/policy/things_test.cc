// What a point belongs to, what hangs together, and what training does with it.
#include "policy/things.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "policy/surroundings.h"
#include "policy/symmetric_yaw.h"

namespace flowscope {
namespace {

using Eigen::Vector3f;

/// A flat square ring of 50 mm with bars of 10 mm, turned by `yaw_rad` about `center`, in points 5 mm apart.
std::vector<Vector3f> ring(const Vector3f& center, float yaw_rad) {
  std::vector<Vector3f> points;
  for (int i = -5; i <= 5; ++i) {
    for (int j = -5; j <= 5; ++j) {
      if (std::abs(i) < 3 && std::abs(j) < 3) continue;
      const float x = 0.005f * static_cast<float>(i), y = 0.005f * static_cast<float>(j);
      points.push_back(center + Vector3f(std::cos(yaw_rad) * x - std::sin(yaw_rad) * y,
                                         std::sin(yaw_rad) * x + std::cos(yaw_rad) * y, 0));
    }
  }
  return points;
}

double degrees(double rad) { return rad * 180 / std::numbers::pi; }

TEST(Surroundings, EveryPointOfARingKnowsItsMiddleAndYaw) {
  for (const float yaw : {-0.6f, 0.f, 0.3f, 0.7f}) {
    const Vector3f center(0.2f, -0.1f, 0.76f);
    const auto points = ring(center, yaw);
    const std::vector<Vector3f> colors(points.size(), Vector3f(0.8f, 0.7f, 0.6f));
    const auto around = find_surroundings(points, colors, std::vector<char>(points.size(), 0));
    for (const Surroundings& s : around) {
      EXPECT_LT((s.middle - center).norm(), 0.002f);
      // The corners of a square lie at 45 degrees to its sides.
      const double seen = std::atan2(s.square.y(), s.square.x()) / 4 + std::numbers::pi / 4;
      EXPECT_NEAR(degrees(std::remainder(seen - yaw, std::numbers::pi / 2)), 0, 1.5);
      EXPECT_GT(s.square.norm(), 0.1f);
    }
  }
}

TEST(Surroundings, OtherColoursAndTheTableDoNotCount) {
  auto points = ring({0, 0, 0.76f}, 0);
  std::vector<Vector3f> colors(points.size(), Vector3f(0.8f, 0.7f, 0.6f));
  const std::size_t own = points.size();
  for (int i = 0; i < 40; ++i) {
    points.push_back({0.03f, 0.001f * static_cast<float>(i), 0.76f});
    colors.push_back(i % 2 == 0 ? Vector3f(0, 0, 1) : Vector3f(0.8f, 0.7f, 0.6f));
  }
  std::vector<char> skip(points.size(), 0);
  for (std::size_t i = own + 1; i < points.size(); i += 2) skip[i] = 1;
  const auto around = find_surroundings(points, colors, skip);
  EXPECT_LT(around.front().middle.norm() - 0.76f, 0.002f);
  EXPECT_LT(around.front().middle.head<2>().norm(), 0.002f);
  EXPECT_EQ(around.back().middle, points.back());
}

TEST(Surroundings, TurnAndShiftWithTheScene) {
  const float yaw = 0.4f;
  const Vector3f center(0.2f, 0.1f, 0.76f), shift(0.05f, -0.02f, 0.01f);
  const auto turn = [&](const Vector3f& p) {
    return Vector3f(std::cos(yaw) * p.x() - std::sin(yaw) * p.y() + shift.x(),
                    std::sin(yaw) * p.x() + std::cos(yaw) * p.y() + shift.y(), p.z() + shift.z());
  };
  auto points = ring(center, 0.1f);
  const std::vector<Vector3f> colors(points.size(), Vector3f::Ones());
  const std::vector<char> none(points.size(), 0);
  const Surroundings before = moved(find_surroundings(points, colors, none).front(), yaw, shift);
  for (Vector3f& p : points) p = turn(p);
  const Surroundings after = find_surroundings(points, colors, none).front();
  EXPECT_LT((before.middle - after.middle).norm(), 1e-5f);
  EXPECT_LT((before.square - after.square).norm(), 1e-4f);
  EXPECT_LT((before.bar - after.bar).norm(), 1e-4f);
}

struct Tinted {
  std::vector<Vector3f> place, color;
  std::vector<char> skip;
};

/// Heaps of points, some alike in colour, some skipped; most neighbours share cells with strangers.
Tinted heaps(int count) {
  Random random(9);
  const auto vector = [&random](double reach) {
    Vector3f v;
    for (float& x : v) x = static_cast<float>(random.uniform(-reach, reach));
    return v;
  };
  Tinted t;
  for (int i = 0; i < count; ++i) {
    const float heap = 0.3f * static_cast<float>(random.below(4));
    t.place.push_back(vector(i % 5 == 0 ? 0.4 : 0.05) + Vector3f(heap, -heap, 0.75f));
    t.color.push_back(Vector3f::Constant(0.5f) + vector(0.25));
    t.skip.push_back(random.below(6) == 0);
  }
  return t;
}

/// Mean shift as it is written down: every point against every other.
Surroundings plain_surroundings(const Tinted& t, std::size_t i, std::size_t counted) {
  Surroundings out;
  out.middle = t.place[i];
  if (t.skip[i]) return out;
  std::vector<std::size_t> near;
  for (int round = 0; round < 3; ++round) {
    near.clear();
    Vector3f sum = Vector3f::Zero();
    for (std::size_t j = 0; j < counted; ++j) {
      if (t.skip[j] || (t.place[j] - out.middle).squaredNorm() > 0.045f * 0.045f ||
          (t.color[j] - t.color[i]).squaredNorm() > 0.3f * 0.3f)
        continue;
      near.push_back(j);
      sum += t.place[j];
    }
    if (near.empty()) break;
    out.middle = sum / static_cast<float>(near.size());
  }
  out.neighbours = static_cast<int>(near.size());
  return out;
}

TEST(Surroundings, AreThoseOfThePlainMeanShiftToTheBit) {
  const Tinted t = heaps(1500);
  const auto around = find_surroundings(t.place, t.color, t.skip);
  int most = 0;
  for (std::size_t i = 0; i < around.size(); ++i) {
    const Surroundings plain = plain_surroundings(t, i, t.place.size());
    EXPECT_EQ(around[i].middle, plain.middle) << "point " << i;
    EXPECT_EQ(around[i].neighbours, plain.neighbours) << "point " << i;
    most = std::max(most, plain.neighbours);
  }
  EXPECT_GT(most, 20);
}

TEST(Surroundings, CountOnlyTheFirstOfVeryManyPoints) {
  const Tinted t = heaps(7000);
  std::size_t counted = 0;
  for (std::size_t found = 0; found < surroundings_sample; ++counted) found += t.skip[counted] ? 0 : 1;
  ASSERT_LT(counted, t.place.size());
  const auto around = find_surroundings(t.place, t.color, t.skip);
  for (std::size_t i = 0; i < around.size(); i += 37) {
    const Surroundings plain = plain_surroundings(t, i, counted);
    EXPECT_EQ(around[i].middle, plain.middle) << "point " << i;
    EXPECT_EQ(around[i].neighbours, plain.neighbours) << "point " << i;
  }
}

TEST(SymmetricYaw, TakesTheEqualTurnNearestToTheTool) {
  const double yaw = 0.2;
  const torch::Tensor moment = torch::tensor({{{std::cos(4 * yaw), std::sin(4 * yaw)}}}, torch::kFloat32);
  const double tool = 0.2 + std::numbers::pi / 2 + 0.1;
  const torch::Tensor tool_x = torch::tensor({{std::cos(tool), std::sin(tool), 0.0}}, torch::kFloat32);
  const torch::Tensor seen = symmetric_yaw(moment, tool_x, 4, 0);
  EXPECT_NEAR(std::atan2(seen[0][0][1].item<double>(), seen[0][0][0].item<double>()),
              yaw + std::numbers::pi / 2, 1e-5);
  const torch::Tensor direction = torch::tensor({{{std::cos(yaw), std::sin(yaw), 0.0}}}, torch::kFloat32);
  const torch::Tensor quarter = nearest_quarter(direction, tool_x);
  EXPECT_NEAR(std::atan2(quarter[0][0][1].item<double>(), quarter[0][0][0].item<double>()),
              yaw + std::numbers::pi / 2, 1e-5);
}

struct Tabletop {
  std::vector<Vector3f> points;
  std::vector<int> thing;
};

/// Two rings 20 cm apart and a tool above neither.
Tabletop two_rings() {
  Tabletop t;
  t.points = ring({0.1f, 0.1f, 0.76f}, 0);
  for (const Vector3f& p : ring({0.3f, 0.1f, 0.76f}, 0.5f)) t.points.push_back(p);
  t.thing = find_things(t.points, std::vector<char>(t.points.size(), 0));
  return t;
}

TEST(Things, WhatHangsTogetherIsOneThing) {
  const Tabletop t = two_rings();
  EXPECT_EQ(t.thing.front(), 0);
  EXPECT_EQ(t.thing.back(), 1);
  EXPECT_EQ(thing_at(t.points, t.thing, 0.752f, {0.3f, 0.1f, 0.9f}), 1);
  EXPECT_EQ(thing_at(t.points, t.thing, 0.752f, {0.3f, 0.2f, 0.9f}), 1) << "waiting in front of it";
  EXPECT_EQ(thing_at(t.points, t.thing, 0.752f, {0.3f, 0.4f, 0.9f}), -1);
  EXPECT_EQ(thing_at(t.points, t.thing, 0.652f, {0.3f, 0.1f, 0.9f}), -1) << "it hangs in the air";
}

TEST(Things, AreThoseOfAPlainFlood) {
  for (const int count : {0, 1, 40, 1200}) {
    const Tinted t = heaps(count);
    std::vector<int> expected(t.place.size(), -1);
    int things = 0;
    for (std::size_t start = 0; start < t.place.size(); ++start) {
      if (t.skip[start] || expected[start] >= 0) continue;
      expected[start] = things++;
      for (bool grown = true; grown;) {
        grown = false;
        for (std::size_t i = 0; i < t.place.size(); ++i)
          for (std::size_t j = 0; expected[i] == expected[start] && j < t.place.size(); ++j) {
            if (t.skip[j] || expected[j] >= 0 || (t.place[i] - t.place[j]).squaredNorm() > 0.025f * 0.025f)
              continue;
            expected[j] = expected[i];
            grown = true;
          }
      }
    }
    EXPECT_EQ(find_things(t.place, t.skip), expected) << count << " points";
    EXPECT_GE(things, count / 100);
  }
}

TEST(Things, FindNoneWhereAPointIsNotFinite) {
  EXPECT_THROW(find_things({{0, 0, std::numeric_limits<float>::infinity()}}, {0}), std::invalid_argument);
}

TEST(Things, AreShiftedApartButNotUnderTheTool) {
  const Tabletop t = two_rings();
  Random random(5);
  float farthest = 0, most_turned = 0;
  for (int i = 0; i < 200; ++i) {
    const auto moves = shuffle_things(t.points, t.thing, 0.752f, {0.1f, 0.1f, 0.80f}, 0.25f, random);
    EXPECT_TRUE(moves[0].shift.isZero() && moves[0].yaw_rad == 0) << "the tool is at it";
    EXPECT_EQ(moves[1].shift.z(), 0);
    const Vector3f second = Vector3f(0.3f, 0.1f, 0.76f) + moves[1].shift;
    EXPECT_GT((second - Vector3f(0.1f, 0.1f, 0.76f)).norm(), 0.06f) << "it would stand in the other";
    farthest = std::max(farthest, moves[1].shift.norm());
    most_turned = std::max(most_turned, std::abs(moves[1].yaw_rad));
  }
  EXPECT_GT(farthest, 0.15f);
  EXPECT_GT(most_turned, 0.3f);
  EXPECT_LT(most_turned, 0.5f);
}

}  // namespace
}  // namespace flowscope
