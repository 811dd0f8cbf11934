// Limits hold along whole paths, corners included: measured on the targets themselves.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "recorder/motion/ik_recovery.h"
#include "recorder/motion/rounded_path.h"
#include "recorder/motion/time_law.h"
#include "recorder/motion/trajectory.h"

namespace flowscope {
namespace {

constexpr double kFrame_s = 0.05;
constexpr JointLimits kLimits{{-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973},
                              {2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973}};

/// Checks velocities, accelerations and braking of every joint by differences, at rest before and after.
void expect_limits(const JointPath& path, const JointPath& targets, const MotionLimits& limits,
                   const std::string& what) {
  ASSERT_FALSE(targets.empty()) << what;
  EXPECT_EQ(targets.back(), path.back()) << what;
  JointPath all{path.front(), path.front()};
  all.insert(all.end(), targets.begin(), targets.end());
  all.push_back(targets.back());
  double fastest = 0, hardest = 0;
  for (std::size_t k = 1; k + 1 < all.size(); ++k) {
    for (std::size_t i = 0; i < path.front().size(); ++i) {
      const double before = (all[k][i] - all[k - 1][i]) / kFrame_s,
                   after = (all[k + 1][i] - all[k][i]) / kFrame_s;
      fastest = std::max(fastest, std::abs(after));
      hardest = std::max(hardest, std::abs(after - before) / kFrame_s);
    }
  }
  EXPECT_LE(fastest, limits.velocity * (1 + 1e-9)) << what;
  EXPECT_LE(hardest, limits.acceleration * (1 + 1e-6)) << what;
}

TEST(Timing, LimitsHoldOnRandomPathsWithCorners) {
  std::mt19937_64 random(1);
  for (std::uint64_t run = 0; run < 300; ++run) {
    JointPath path;
    const int corners = 2 + static_cast<int>(random() % 9);
    const double size =
        std::pow(10.0, -3.0 * double(run % 4) / 3);  // from whole postures to a tenth of a degree
    for (int i = 0; i < corners; ++i) {
      JointVector q = random_posture(kLimits, run, static_cast<std::uint64_t>(i));
      if (!path.empty()) {
        for (std::size_t k = 0; k < q.size(); ++k) q[k] = std::lerp(path.back()[k], q[k], size);
      }
      path.push_back(q);
    }
    MotionLimits limits;
    limits.velocity = 0.5 + double(run % 3);
    limits.acceleration = 2 + double(run % 5);
    limits.deceleration = limits.acceleration / (1 + double(run % 2));
    for (const double corner_rad : {0.1, 0.01, 0.0}) {
      const std::string what =
          "run " + std::to_string(run) + ", corners cut by " + std::to_string(corner_rad);
      const JointPath targets = timed_targets(path, limits, corner_rad);
      expect_limits(path, targets, limits, what);
      EXPECT_EQ(targets, timed_targets(path, limits, corner_rad)) << what;
    }
  }
}

TEST(Timing, AStraightStretchIsAsFastAsTheLimitsAllow) {
  const JointVector start{-1, 0.2, 0, -2, 0, 2, 0};
  JointVector goal = start;
  goal[0] += 2;
  const MotionLimits limits;
  // Up to speed, along, and down again.
  const double seconds = 2 / 1.5 + 0.5 * 1.5 / 6 + 0.5 * 1.5 / 3;
  EXPECT_NEAR(double(timed_targets({start, goal}, limits).size()) * kFrame_s, seconds, kFrame_s);
}

TEST(Timing, BrakesGently) {
  const JointVector start{-1, 0.2, 0, -2, 0, 2, 0};
  JointVector goal = start;
  goal[0] += 2;
  const JointPath targets = timed_targets({start, goal});
  for (std::size_t k = 1; k + 1 < targets.size(); ++k) {
    const double change = (targets[k + 1][0] - 2 * targets[k][0] + targets[k - 1][0]) / (kFrame_s * kFrame_s);
    EXPECT_GE(change, -3 * (1 + 1e-6));
  }
}

TEST(Timing, CornersAreCutByNoMoreThanAsked) {
  JointVector a{-1, 0.2, 0, -2, 0, 2, 0}, b = a, c = a;
  b[0] += 1;
  c[0] += 1, c[1] += 1;
  for (const double corner_rad : {0.1, 0.02}) {
    const RoundedPath path({a, b, c}, corner_rad);
    double nearest = 1;
    for (double s = 0; s <= path.length(); s += 1e-3) {
      const JointVector q = path.at(s);
      nearest = std::min(nearest, std::hypot(q[0] - b[0], q[1] - b[1]));
      EXPECT_TRUE(q[0] <= b[0] + 1e-12 && q[1] >= b[1] - 1e-12);
    }
    EXPECT_NEAR(nearest, corner_rad, 1e-3);
    EXPECT_EQ(path.at(0), a);
    EXPECT_LT(joint_distance(path.at(path.length()), c), 1e-12);
  }
  EXPECT_EQ(RoundedPath({a, a, a}, 0.1).length(), 0);
}

TEST(Timing, ARoundedCornerIsNoStopAndASharpOneIs) {
  JointVector a{-1, 0.2, 0, -2, 0, 2, 0}, b = a, c = a;
  b[0] += 1;
  c[0] += 1, c[1] += 1;
  const auto slowest = [&](double corner_rad) {
    const JointPath targets = timed_targets({a, b, c}, {}, corner_rad);
    double result = 100;
    for (std::size_t k = 3; k + 6 < targets.size(); ++k) {
      result = std::min(result, joint_distance(targets[k], targets[k + 1]) / kFrame_s);
    }
    return result;
  };
  EXPECT_GT(slowest(0.05), 0.4);
  EXPECT_LT(slowest(0), 0.1);
}

TEST(Timing, BackTheSameWayHasToStop) {
  const JointVector a{-1, 0.2, 0, -2, 0, 2, 0};
  JointVector b = a;
  b[2] += 0.7;
  const JointPath path{a, b, a}, targets = timed_targets(path);
  expect_limits(path, targets, {}, "there and back");
  double farthest = 0;
  for (const auto& q : targets) farthest = std::max(farthest, q[2]);
  EXPECT_NEAR(farthest, 0.7, 0.01);
}

}  // namespace
}  // namespace flowscope
