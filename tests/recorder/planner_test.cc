#include "recorder/motion/planner.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "recorder/motion/trajectory.h"

namespace flowscope {
namespace {

constexpr JointLimits kLimits{{-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973},
                              {2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973}};
const JointVector kStart{-1, 0.2, 0, -2, 0, 2, 0}, kGoal{1, 0.2, 0, -2, 0, 2, 0};

/// A wall across the first joint's way with a gap high up: the second joint has to lean back to pass.
bool past_the_wall(const JointVector& q) { return std::abs(q[0]) > 0.3 || q[1] < -0.6; }

double length(const JointPath& path) {
  double sum = 0;
  for (std::size_t i = 1; i < path.size(); ++i) sum += joint_distance(path[i - 1], path[i]);
  return sum;
}

TEST(Planner, TakesTheStraightLineWhenFree) {
  const Plan plan = plan_joint_path(kStart, {kGoal}, kLimits, [](const JointVector&) { return true; }, {});
  ASSERT_EQ(plan.outcome, PlanOutcome::solved);
  EXPECT_EQ(plan.path, (JointPath{kStart, kGoal}));
}

TEST(Planner, GoesAroundAndStaysFreeAtFinerResolution) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Plan plan = plan_joint_path(kStart, {kGoal}, kLimits, past_the_wall, {seed, 20'000, 30});
    ASSERT_EQ(plan.outcome, PlanOutcome::solved);
    EXPECT_EQ(plan.path.front(), kStart);
    EXPECT_EQ(plan.path.back(), kGoal);
    for (std::size_t i = 1; i < plan.path.size(); ++i) {
      EXPECT_TRUE(segment_is_free(plan.path[i - 1], plan.path[i], past_the_wall, 0.0025));
    }
    EXPECT_LT(length(plan.path), 6) << "at least 2 rad across; shortening should leave no long tours";
  }
}

TEST(Planner, SameSeedSamePathWhateverCameBefore) {
  const PlanLimits search{7, 20'000, 30};
  const Plan first = plan_joint_path(kStart, {kGoal}, kLimits, past_the_wall, search);
  plan_joint_path(kStart, {kGoal}, kLimits, past_the_wall, {8, 20'000, 30});
  EXPECT_EQ(plan_joint_path(kStart, {kGoal}, kLimits, past_the_wall, search).path, first.path);
  EXPECT_NE(plan_joint_path(kStart, {kGoal}, kLimits, past_the_wall, {9, 20'000, 30}).path, first.path);
}

TEST(Planner, HopelessSearchEndsWithItsReason) {
  const auto closed = [](const JointVector& q) { return std::abs(q[0]) > 0.3; };
  EXPECT_EQ(plan_joint_path(kStart, {kGoal}, kLimits, closed, {1, 500, 30}).outcome, PlanOutcome::no_path);
  EXPECT_EQ(plan_joint_path(kStart, {kGoal}, kLimits, closed, {1, 1'000'000'000, 0.05}).outcome,
            PlanOutcome::timed_out);
  EXPECT_EQ(plan_joint_path(kStart, {}, kLimits, closed, {}).outcome, PlanOutcome::no_path);
}

TEST(Planner, StopsWhenAsked) {
  std::stop_source stop;
  int checks = 0;
  const auto closed = [&](const JointVector& q) {
    if (++checks == 2000) stop.request_stop();
    return std::abs(q[0]) > 0.3;
  };
  const Plan plan =
      plan_joint_path(kStart, {kGoal}, kLimits, closed, {1, 1'000'000'000, 60}, stop.get_token());
  EXPECT_EQ(plan.outcome, PlanOutcome::cancelled);
  EXPECT_TRUE(plan.path.empty());
}

TEST(Planner, ErrorsOfTheCheckComeOut) {
  const auto broken = [](const JointVector& q) -> bool {
    if (std::abs(q[0]) < 0.1) throw std::runtime_error("no model");
    return true;
  };
  EXPECT_THROW(plan_joint_path(kStart, {kGoal}, kLimits, broken, {}), std::runtime_error);
}

TEST(Trajectory, KeepsItsLimitsAndEndsAtTheGoal) {
  const MotionLimits limits;
  for (const double length_rad : {0.004, 0.05, 0.3, 2.0}) {
    JointVector goal = kStart;
    goal[3] += length_rad / 2;
    goal[5] -= length_rad;
    const JointPath targets = timed_targets({kStart, goal}, limits);
    ASSERT_FALSE(targets.empty());
    EXPECT_EQ(targets.back(), goal);
    JointVector before = kStart;
    double speed_before = 0;
    for (const auto& target : targets) {
      const double speed = joint_distance(before, target) / 0.05;
      EXPECT_LE(speed, limits.velocity + 1e-9);
      EXPECT_LE(std::abs(speed - speed_before) / 0.05, limits.acceleration + 1e-6);
      before = target;
      speed_before = speed;
    }
    EXPECT_LE(speed_before / 0.05, limits.acceleration + 1e-6);  // the last stretch ends at rest
  }
  EXPECT_TRUE(timed_targets({kStart}, limits).empty());
  EXPECT_TRUE(timed_targets({kStart, kStart}, limits).empty());
}

TEST(Trajectory, LeadsTheToolAlongAStraightLine) {
  const Kinematics arm({}, {{0, 0, 0.1034}, Eigen::Quaterniond::Identity()}, kLimits);
  const JointVector start{0.1, 0.4, -0.1, -2.0, 0.1, 2.4, 0.5};
  const Pose from = arm.world_from_tool(start);
  Pose to = from;
  to.position += Eigen::Vector3d(0.05, 0.12, -0.1);
  to.rotation = to.rotation * Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ());
  const JointPath path = straight_tool_path(arm, start, to);
  ASSERT_GT(path.size(), 10u);
  EXPECT_EQ(path.front(), start);
  EXPECT_LT(position_error_m(arm.world_from_tool(path.back()), to), 1e-9);
  const Eigen::Vector3d along = (to.position - from.position).normalized();
  for (std::size_t i = 1; i < path.size(); ++i) {
    const Eigen::Vector3d offset = arm.world_from_tool(path[i]).position - from.position;
    EXPECT_LT((offset - offset.dot(along) * along).norm(), 1e-9);
    EXPECT_LT(joint_distance(path[i - 1], path[i]), 0.12);
  }
}

TEST(Trajectory, PassesCloseByASingularityInSmallerSteps) {
  const Kinematics arm({}, {{0, 0, 0.1034}, Eigen::Quaterniond::Identity()}, kLimits);
  const JointVector start{-0.241, -0.073, -0.110, -2.593, -0.013, 2.520, -1.125};  // q2 passes 0 on the way
  const Pose from = arm.world_from_tool(start);
  Pose to = from;
  to.position.z() -= 0.055;
  double reached = -1;
  EXPECT_TRUE(straight_tool_path(arm, start, to, &reached, {}, LineEffort::quick).empty());
  EXPECT_LT(reached, 0.9);
  const JointPath path = straight_tool_path(arm, start, to, &reached);
  ASSERT_FALSE(path.empty());
  EXPECT_EQ(reached, 1);
  for (std::size_t i = 1; i < path.size(); ++i) {
    const Eigen::Vector3d offset = arm.world_from_tool(path[i]).position - from.position;
    EXPECT_LT(offset.head<2>().norm(), 1e-9);
    EXPECT_LE(joint_distance(path[i - 1], path[i]), 0.12);
  }
}

TEST(Trajectory, SaysHowFarALineOutOfReachWent) {
  const Kinematics arm({}, {}, kLimits);
  const JointVector start{0.1, 0.4, -0.1, -2.0, 0.1, 2.4, 0.5};
  Pose to = arm.world_from_tool(start);
  to.position.x() += 1.5;
  double reached = -1;
  EXPECT_TRUE(straight_tool_path(arm, start, to, &reached).empty());
  EXPECT_EQ(reached, 0);  // the end itself has no posture, so there is no branch to follow
}

}  // namespace
}  // namespace flowscope
