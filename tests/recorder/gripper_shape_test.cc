// A ghost is the hand of the scene's own robot: at the tool's pose it lies where the hand is.
#include "recorder/gripper_shape.h"

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include "recorder/motion/motion.h"
#include "recorder/task.h"
#include "recorder/world.h"
#include "tests/support/ghost_distance.h"
#include "tests/support/small_scene.h"

namespace flowscope {
namespace {

class GripperShapeOf : public ::testing::TestWithParam<const char*> {};

TEST_P(GripperShapeOf, LiesWhereTheHandIsHoweverFarItIsOpen) {
  const TaskLibrary tasks(FLOWSCOPE_SOURCE_DIR "/assets");
  const auto task = tasks.get(GetParam());
  const auto shape = gripper_shape(task->model(), task->robot());
  ASSERT_NE(shape, nullptr);
  EXPECT_GT(shape->parts.size(), 3u);
  World world(task);
  EXPECT_LT(testing::apart(world, *shape), 0.003) << "open";
  for (const double openness : {0.55, 0.0}) {
    ASSERT_TRUE(move_gripper(world, openness, {}));
    const auto q = world.joint_targets();
    for (int i = 0; i < 10; ++i) world.advance(q, openness);
    EXPECT_LT(testing::apart(world, *shape), 0.003) << openness;
  }
}
INSTANTIATE_TEST_SUITE_P(Robots, GripperShapeOf, ::testing::Values("put_fruit_in_bowl", "push_buttons"));

TEST(GripperShape, DiffersBetweenRobotsAndLeavesCollisionShapesOut) {
  const TaskLibrary tasks(FLOWSCOPE_SOURCE_DIR "/assets");
  const auto ur5 = tasks.get("put_fruit_in_bowl"), panda = tasks.get("push_buttons");
  const auto wide = gripper_shape(ur5->model(), ur5->robot());
  const auto narrow = gripper_shape(panda->model(), panda->robot());
  const auto reach = [](const GripperShape& shape) {
    double most = 0;
    for (const auto& part : shape.parts)
      most = std::max(most, std::abs(tool_from_part(part, 1).position.y()));
    return most;
  };
  EXPECT_GT(reach(*wide), reach(*narrow) + 0.02);
  const int pad = mj_name2id(ur5->model(), mjOBJ_GEOM, "left_pad");
  const Eigen::Map<const Eigen::Vector3d> pad_size(ur5->model()->geom_size + 3 * pad);
  for (const auto& part : wide->parts) EXPECT_NE(part.half_size, pad_size);
}

TEST(GripperShape, IsNoneWhereAPartOfTheRobotIsMissing) {
  const ModelPtr model = testing::compile(R"(<mujoco><worldbody><body name="hand">
    <geom type="box" size="0.1 0.1 0.1"/><site name="tool"/></body></worldbody></mujoco>)");
  RobotDescription robot;
  EXPECT_EQ(gripper_shape(model.get(), robot), nullptr);
  robot.hand = "hand";
  robot.tool = "tool";
  EXPECT_NE(gripper_shape(model.get(), robot), nullptr);
  robot.fingers.push_back({"thumb", "", 1, 0, 0});
  EXPECT_EQ(gripper_shape(model.get(), robot), nullptr);
  const ModelPtr bare = testing::compile(R"(<mujoco><worldbody><body name="hand">
    <geom group="3" type="box" size="0.1 0.1 0.1"/><site name="tool"/></body></worldbody></mujoco>)");
  robot.fingers.clear();
  EXPECT_EQ(gripper_shape(bare.get(), robot), nullptr) << "nothing that a picture shows";
}

}  // namespace
}  // namespace flowscope
