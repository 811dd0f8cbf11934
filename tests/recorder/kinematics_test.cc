#include "recorder/motion/kinematics.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "recorder/motion/ik_recovery.h"
#include "recorder/motion/posture.h"

namespace flowscope {
namespace {

constexpr JointLimits kPandaLimits{{-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973},
                                   {2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973}};

Kinematics panda() {
  const Pose world_from_base{{-0.268, 0.01, 0.75},
                             Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ()))};
  const Pose flange_from_tool{
      {0, 0, 0.1034}, Eigen::Quaterniond(Eigen::AngleAxisd(-std::numbers::pi / 4, Eigen::Vector3d::UnitZ()))};
  return {world_from_base, flange_from_tool, kPandaLimits};
}

JointVector random_joints(std::mt19937_64& random) {
  JointVector q;
  for (std::size_t i = 0; i < q.size(); ++i) {
    q[i] = std::uniform_real_distribution<double>(kPandaLimits.lower[i], kPandaLimits.upper[i])(random);
  }
  return q;
}

double matrix_error(const Pose& a, const Pose& b) {
  return (a.rotation.toRotationMatrix() - b.rotation.toRotationMatrix()).norm();
}

TEST(Kinematics, PublishedFlangeHeightAtZero) {
  const Kinematics arm({}, {}, kPandaLimits);
  // Straight up: x = a7, z = d1 + d3 + d5 - flange.
  const Pose flange = arm.world_from_tool({});
  EXPECT_NEAR(flange.position.x(), 0.088, 1e-12);
  EXPECT_NEAR(flange.position.y(), 0, 1e-12);
  EXPECT_NEAR(flange.position.z(), 0.333 + 0.316 + 0.384 - 0.107, 1e-12);
}

TEST(Kinematics, RecoversRandomPostures) {
  const IkRecovery found = recover_postures(panda(), 2000, 1);
  EXPECT_GE(found.own, 2000 * 0.999);
  EXPECT_GE(found.recovered, 2000 * 0.999);
  EXPECT_LT(found.largest_m, 1e-6);
  EXPECT_LT(found.largest_rad, 1e-6);
}

TEST(Kinematics, EverySolutionReachesThePoseWithinLimits) {
  const Kinematics arm = panda();
  std::mt19937_64 random(2);
  int solved = 0, solutions = 0;
  constexpr int n = 1000;
  for (int i = 0; i < n; ++i) {
    const Pose wanted = arm.world_from_tool(random_joints(random));
    const auto found = arm.solve_all(wanted, random_joints(random), 48);
    bool good = !found.empty();
    for (const auto& q : found) {
      const Pose reached = arm.world_from_tool(q);
      good = good && position_error_m(reached, wanted) < 1e-6 && matrix_error(reached, wanted) < 1e-6;
      EXPECT_TRUE(arm.limits().contain(q));
    }
    solved += good;
    solutions += static_cast<int>(found.size());
  }
  EXPECT_GE(solved, n * 0.999);
  EXPECT_GT(solutions, 20 * n);  // several branches, many q7
}

TEST(Kinematics, ThePresentPostureComesFirst) {
  const Kinematics arm = panda();
  const JointVector home{0, 0.1745, 0, -0.8727, 0, 1.2217, 0.7854};
  const auto found = arm.solve_all(arm.world_from_tool(home), home);
  ASSERT_FALSE(found.empty());
  EXPECT_LT(joint_distance(found.front(), home), 1e-9);
}

TEST(Kinematics, PosturesAreOrderedByDistanceRoomAndManipulability) {
  const Kinematics arm = panda();
  std::mt19937_64 random(3);
  for (int i = 0; i < 50; ++i) {
    const JointVector near = random_joints(random);
    const auto found = arm.solve_all(arm.world_from_tool(random_joints(random)), near);
    const auto cost = [&](const JointVector& q) {
      return posture_cost(q, near, arm.limits(), arm.manipulability(q));
    };
    for (std::size_t k = 1; k < found.size(); ++k) EXPECT_LE(cost(found[k - 1]), cost(found[k]));
  }
  const JointVector near{0, 0.1745, 0, -0.8727, 0, 1.2217, 0.7854};
  JointVector at_limit = near;
  at_limit[3] = kPandaLimits.upper[3] - 0.01;
  EXPECT_GT(posture_cost(at_limit, near, kPandaLimits, 0.1), joint_distance(at_limit, near) + 1);
  EXPECT_GT(posture_cost(near, near, kPandaLimits, 0.001), posture_cost(near, near, kPandaLimits, 0.1) + 0.5);
}

TEST(Kinematics, ManipulabilityIsThatOfTheToolsOwnMotion) {
  const Kinematics arm = panda();
  std::mt19937_64 random(4);
  for (int i = 0; i < 20; ++i) {
    const JointVector q = random_joints(random);
    const Pose here = arm.world_from_tool(q);
    Eigen::Matrix<double, 6, 7> jacobian;
    constexpr double h = 1e-6;
    for (int k = 0; k < 7; ++k) {
      JointVector moved = q;
      moved[static_cast<std::size_t>(k)] += h;
      const Pose there = arm.world_from_tool(moved);
      const Eigen::AngleAxisd turn(there.rotation * here.rotation.inverse());
      const double sign = turn.angle() > std::numbers::pi ? -1 : 1;
      const double angle = sign > 0 ? turn.angle() : 2 * std::numbers::pi - turn.angle();
      jacobian.col(k) << (there.position - here.position) / h, sign * angle / h * turn.axis();
    }
    EXPECT_NEAR(arm.manipulability(q), std::sqrt((jacobian * jacobian.transpose()).determinant()), 1e-5);
  }
  JointVector stretched{};  // the elbow straight is beyond its limit, and singular
  EXPECT_LT(arm.manipulability(stretched), arm.manipulability({0, 0.1745, 0, -0.8727, 0, 1.2217, 0.7854}));
}

TEST(Kinematics, OutOfReachHasNoSolution) {
  const Kinematics arm = panda();
  const JointVector home{0, 0.1745, 0, -0.8727, 0, 1.2217, 0.7854};
  Pose far = arm.world_from_tool(home);
  far.position.x() += 2;
  EXPECT_TRUE(arm.solve_all(far, home).empty());
  far.position.x() = std::nan("");
  EXPECT_TRUE(arm.solve_all(far, home).empty());
}

}  // namespace
}  // namespace flowscope
