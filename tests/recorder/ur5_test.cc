// The second robot in a world: its fingers, its camera, its planner in six dimensions.
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <cmath>

#include "recorder/motion/motion.h"
#include "recorder/record.h"
#include "recorder/world.h"

namespace flowscope {
namespace {

std::shared_ptr<const Task> fruit() {
  static const TaskLibrary library(FLOWSCOPE_SOURCE_DIR "/assets");
  return library.get("put_fruit_in_bowl");
}

/// Between the inner faces of the pads, metres, along the axis on which the fingers open.
double opening(const World& world) {
  const auto pad = [&](const char* name) {
    const int geom = mj_name2id(world.model(), mjOBJ_GEOM, name);
    const Eigen::Vector3d center(world.data()->geom_xpos + 3 * geom);
    const double half = world.model()->geom_size[3 * geom + 1];
    return std::pair(Eigen::Vector3d(world.world_from("tool").inverse() * center), half);
  };
  const auto [left, left_half] = pad("left_pad");
  const auto [right, right_half] = pad("right_pad");
  return left.y() - right.y() - left_half - right_half;
}

/// How far a finger has turned out of the hand's direction, rad.
double leaning(const World& world, const char* finger) {
  const Pose hand = world.world_from("hand"), body = world.world_from(finger);
  return std::acos(std::clamp(
      (hand.rotation * Eigen::Vector3d::UnitZ()).dot(body.rotation * Eigen::Vector3d::UnitZ()), -1.0, 1.0));
}

TEST(Ur5, OpensBy140MillimetresWithParallelFingers) {
  World world(fruit());
  EXPECT_NEAR(opening(world), 0.140, 0.002);
  EXPECT_GT(world.frame().openness, 0.99);
  ASSERT_TRUE(move_gripper(world, 0, {}));
  const auto q = world.joint_targets();
  for (int i = 0; i < 8; ++i) {
    world.advance(q, 0);
    for (const char* finger : {"left_finger", "right_finger"}) EXPECT_LT(leaning(world, finger), 0.03);
  }
  EXPECT_NEAR(opening(world), 0, 0.003);
  EXPECT_LT(world.frame().openness, 0.02);
  ASSERT_TRUE(move_gripper(world, 0.5, {}));
  for (int i = 0; i < 8; ++i) world.advance(q, 0.5);
  EXPECT_NEAR(world.frame().openness, 0.5, 0.02);
}

TEST(Ur5, IsSeenByOneCamera) {
  EXPECT_EQ(observation_cameras(fruit()->model()), std::vector<std::string>{"front"});
}

TEST(Ur5, PlansInSixDimensions) {
  World world(fruit());
  world.reset(0, 1);
  MoveRequest request;
  request.world_from_tool = world.world_from("bowl");
  request.world_from_tool.position.z() += 0.25;
  request.world_from_tool.rotation = Eigen::Quaterniond(0, 1, 0, 0);
  request.time_limit_s = 30;
  const MotionResult result = move_to(world, request, {});
  EXPECT_TRUE(result) << result.message;
  EXPECT_LT(position_error_m(world.frame().world_from_tool, request.world_from_tool), 0.003);
  EXPECT_EQ(world.frame().q[6], 0);
  request.world_from_tool.position.x() = 2;
  EXPECT_EQ(move_to(world, request, {}).failure, MotionFailure::unreachable);
}

}  // namespace
}  // namespace flowscope
