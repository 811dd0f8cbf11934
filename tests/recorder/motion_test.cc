#include "recorder/motion/motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "recorder/motion/collision.h"
#include "recorder/motion/kinematics.h"
#include "recorder/motion/planner.h"
#include "recorder/record.h"

namespace flowscope {
namespace {

/// A tool pose that looks straight down.
Pose down_at(double x, double y, double z) {
  return {{x, y, z}, Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX()))};
}

class Motion : public ::testing::Test {
 protected:
  static std::shared_ptr<const Task> task(const std::string& name) {
    static const TaskLibrary library(find_assets());
    return library.get(name);
  }
  FrameSink keep() {
    return [this](const Frame& frame) { return frames.push_back(frame), true; };
  }
  std::vector<Frame> frames;
};

TEST_F(Motion, TheScenesArmIsAPanda) {
  World world(task("push_buttons"));
  // throws when further off than 1e-9
  const Kinematics kinematics = Kinematics::from_model(world.model(), world.task().robot());
  EXPECT_LT(position_error_m(kinematics.world_from_tool(world.frame().q), world.frame().world_from_tool),
            1e-6);
}

TEST_F(Motion, PlannedMoveArrivesAndStopsOnlyAtItsEnd) {
  World world(task("push_buttons"));
  world.reset(0, 1);
  MoveRequest request;
  request.world_from_tool = down_at(0.35, 0.2, 1.1);
  const MotionResult result = move_to(world, request, keep());
  ASSERT_TRUE(result) << result.message;
  EXPECT_LT(position_error_m(world.frame().world_from_tool, request.world_from_tool), 0.003);
  EXPECT_LT(rotation_error_rad(world.frame().world_from_tool, request.world_from_tool), 0.02);
  ASSERT_GT(frames.size(), 8u);
  for (std::size_t i = 2; i + 1 < frames.size(); ++i) {
    double fastest = 0;
    for (const double dq : frames[i].dq) fastest = std::max(fastest, std::abs(dq));
    EXPECT_GT(fastest, 0.1) << "looks like a stop at frame " << i;
  }
}

TEST_F(Motion, LinearMoveKeepsTheToolOnItsLine) {
  World world(task("push_buttons"));
  world.reset(0, 1);
  MoveRequest request;
  request.world_from_tool = down_at(0.35, 0.1, 1.15);
  ASSERT_TRUE(move_to(world, request, {}));
  const Eigen::Vector3d from = world.frame().world_from_tool.position;
  request.world_from_tool = down_at(0.35, -0.1, 1.05);
  request.linear = true;
  const MotionResult result = move_to(world, request, keep());
  ASSERT_TRUE(result) << result.message;
  const Eigen::Vector3d along = (request.world_from_tool.position - from).normalized();
  for (const auto& frame : frames) {
    const Eigen::Vector3d offset = frame.world_from_tool.position - from;
    EXPECT_LT((offset - offset.dot(along) * along).norm(), 0.004);
  }
}

TEST_F(Motion, OutOfReachIsUnreachable) {
  World world(task("push_buttons"));
  MoveRequest request;
  request.world_from_tool = down_at(2, 0, 1);
  const MotionResult planned = move_to(world, request, keep());
  EXPECT_EQ(planned.failure, MotionFailure::unreachable);
  EXPECT_NE(planned.message.find("(2.000, 0.000, 1.000) m"), std::string::npos) << planned.message;
  EXPECT_EQ(planned.world_from_tool, request.world_from_tool);
  request.linear = true;
  EXPECT_EQ(move_to(world, request, keep()).failure, MotionFailure::unreachable);
  EXPECT_TRUE(frames.empty());
}

TEST_F(Motion, ATouchingGoalSaysWhatIsTouched) {
  World world(task("push_buttons"));
  MoveRequest request;
  request.world_from_tool = down_at(0.3, 0, 0.70);  // below the table's top
  const MotionResult planned = move_to(world, request, keep());
  EXPECT_EQ(planned.failure, MotionFailure::in_collision);
  EXPECT_NE(planned.message.find("table"), std::string::npos) << planned.message;
  EXPECT_EQ(planned.world_from_tool, request.world_from_tool);
  request.linear = true;
  const MotionResult straight = move_to(world, request, keep());
  EXPECT_EQ(straight.failure, MotionFailure::in_collision);
  EXPECT_NE(straight.message.find("% of the way"), std::string::npos) << straight.message;
  EXPECT_TRUE(frames.empty());
}

TEST_F(Motion, ALineMayPushWhatGivesWayButNothingElse) {
  // Through the block, low over the table; and on, through the table.
  for (const double below_m : {0.0, 0.1}) {
    World world(task("slide_block_to_color_target"));
    world.reset(0, 1);
    const Eigen::Vector3d block = world.world_from("block").position;
    MoveRequest request;
    request.world_from_tool = down_at(block.x() - 0.12, block.y(), block.z() + 0.02);
    ASSERT_TRUE(move_to(world, request, {}));
    ASSERT_TRUE(move_gripper(world, 0, {}));
    request.linear = true;
    request.world_from_tool = down_at(block.x(), block.y(), block.z() + 0.02 - below_m);
    EXPECT_EQ(plan_move(world, request).result.failure, MotionFailure::in_collision);
    request.may_push = true;
    EXPECT_EQ(static_cast<bool>(plan_move(world, request).result), below_m == 0);
  }
}

TEST_F(Motion, AHandToldAgainToCloseKeepsWhatItHolds) {
  World world(task("stack_cups"));  // a cup's wall is so thin that the fingers close to nothing
  world.reset(0, 1);
  Script taking = world.episode().demonstration;
  taking.steps.resize(3);  // over a cup, down to its wall, close
  run_script(world, taking, {});
  ASSERT_EQ(world.grasped().size(), 1u);
  ASSERT_TRUE(move_gripper(world, 0, {}));
  EXPECT_EQ(world.grasped().size(), 1u);
}

TEST_F(Motion, GoesAroundTheCabinet) {
  World world(task("open_drawer"));
  world.reset(0, 3);
  const Pose world_from_cabinet = world.world_from("cabinet");
  MoveRequest request;
  // In front of the cabinet, then behind it, lower than its top; the straight line between leads through it.
  for (const double y : {0.38, -0.43}) {
    request.world_from_tool =
        down_at(world_from_cabinet.position.x(), world_from_cabinet.position.y() + y, 1.15);
    const MotionResult result = move_to(world, request, [&](const Frame& frame) {
      CollisionChecker checker(world);
      EXPECT_FALSE(checker.touches(frame.q)) << checker.describe(frame.q);
      return true;
    });
    EXPECT_TRUE(result) << result.message;
  }
}

TEST_F(Motion, StopsWhenTheSinkOrTheTokenSaysSo) {
  World world(task("push_buttons"));
  MoveRequest request;
  request.world_from_tool = down_at(0.35, 0.2, 1.1);
  int seen = 0;
  EXPECT_TRUE(move_to(world, request, [&](const Frame&) { return ++seen < 5; }));
  EXPECT_EQ(seen, 5);
  std::stop_source stop;
  const MotionResult cancelled = move_to(
      world, request, [&](const Frame&) { return stop.request_stop(), true; }, stop.get_token());
  EXPECT_EQ(cancelled.failure, MotionFailure::cancelled);
}

TEST_F(Motion, WhatIsCommandedIsFreeAtFourTimesFinerResolution) {
  World world(task("open_drawer"));
  world.reset(0, 3);
  const Pose cabinet = world.world_from("cabinet");
  for (const double y : {0.38, -0.43}) {
    MoveRequest request;
    request.world_from_tool = down_at(cabinet.position.x(), cabinet.position.y() + y, 1.15);
    CollisionChecker checker(world);
    const auto is_free = [&](const JointVector& q) { return checker.is_free(q); };
    JointPath targets{world.frame().q};
    const PlannedMove move = plan_move(world, request);
    ASSERT_TRUE(move.result) << move.result.message;
    targets.insert(targets.end(), move.targets.begin(), move.targets.end());
    ASSERT_TRUE(move_to(world, request, {}));
    EXPECT_TRUE(path_is_free(targets, is_free, 0.0006));
  }
}

TEST_F(Motion, AMoveThatMayTouchKeepsTheArmsLinksOutOfThings) {
  World world(task("put_item_in_drawer"));
  world.reset(0, 1);
  const Pose item = world.world_from("item");
  MoveRequest request;
  request.world_from_tool = {item.position + Eigen::Vector3d(0, 0, 0.02), Eigen::Quaterniond(0, 1, 0, 0)};
  request.ignore_collisions = true;
  CollisionChecker checker(world);
  ASSERT_TRUE(move_to(world, request, keep()));
  for (const auto& frame : frames) EXPECT_TRUE(checker.links_are_free(frame.q)) << checker.describe(frame.q);
}

TEST_F(Motion, GripperChangesItsBitInOneFrame) {
  World world(task("push_buttons"));
  ASSERT_TRUE(move_gripper(world, 0.1, keep()));
  ASSERT_FALSE(frames.empty());
  EXPECT_FALSE(frames.front().gripper_open);
  EXPECT_LT(frames.size(), 4u) << "a longer stay would be a keyframe of its own";
  const auto q = world.frame().q;
  for (int i = 0; i < 5; ++i) world.advance(q, 0.1);
  EXPECT_NEAR(world.frame().openness, 0.1, 0.02);
  frames.clear();
  ASSERT_TRUE(move_gripper(world, 1, keep()));
  EXPECT_TRUE(frames.front().gripper_open);
}

}  // namespace
}  // namespace flowscope
