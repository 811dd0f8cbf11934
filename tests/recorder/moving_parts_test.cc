// What goes along with the hand, and what does not.
#include "recorder/motion/moving_parts.h"

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include "tests/support/small_scene.h"

namespace flowscope {
namespace {

/// A hinge about z, a hand half a metre from it, and a thing in the hand that stands on `joints` in a holder.
std::string scene(const std::string& joints) {
  return R"(<mujoco><worldbody>
    <body name="hand"><joint name="turn" axis="0 0 1"/><geom type="box" size="0.01 0.01 0.01" pos="0.5 0 0"/>
      <site name="tool" pos="0.5 0 0"/></body>
    <body name="holder" pos="0.5 0 -0.1"><body name="thing" pos="0 0 0.05">)" +
         joints +
         R"(<geom name="thing" type="box" size="0.02 0.01 0.01"/>
      <body name="lid" pos="0 0 0.02"><joint axis="1 0 0"/><geom name="lid" type="sphere" size="0.01"/></body>
    </body></body></worldbody></mujoco>)";
}

/// Where the lid is after a quarter turn of the hand.
Eigen::Vector3d lid_after_turn(const std::string& joints, bool held) {
  const ModelPtr model = testing::compile(scene(joints));
  const DataPtr data(mj_makeData(model.get()));
  mj_forward(model.get(), data.get());
  ArmIndices arm;
  arm.joints = 1;
  arm.hand = mj_name2id(model.get(), mjOBJ_BODY, "hand");
  arm.tool_site = 0;
  MovingParts parts(model.get(), data.get(), arm,
                    held ? std::vector<std::string>{"thing"} : std::vector<std::string>{});
  const int lid = mj_name2id(model.get(), mjOBJ_BODY, "lid");
  EXPECT_EQ(parts.in_hand(lid), held);
  parts.place({1.5707963267948966}, data.get());
  return Eigen::Vector3d(data->geom_xpos + 3 * mj_name2id(model.get(), mjOBJ_GEOM, "lid"));
}

const std::string slides = R"(<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>)";
const Eigen::Vector3d here(0.5, 0, -0.03), there(0, 0.5, -0.03);

TEST(MovingParts, TakeAlongWhatNothingHoldsBack) {
  const std::string six = slides + R"(<joint type="slide" axis="0 0 1"/><joint type="ball"/>)";
  EXPECT_LT((lid_after_turn(six, true) - there).norm(), 1e-9);
  EXPECT_LT((lid_after_turn(six, false) - here).norm(), 1e-9);
}

TEST(MovingParts, LeaveWhereItIsWhatJointsHoldBack) {
  EXPECT_LT((lid_after_turn(slides, true) - here).norm(), 1e-9);
  const std::string stopped =
      slides + R"(<joint type="slide" axis="0 0 1" limited="true" range="0 0.1"/><joint type="ball"/>)";
  EXPECT_LT((lid_after_turn(stopped, true) - here).norm(), 1e-9);
}

}  // namespace
}  // namespace flowscope
