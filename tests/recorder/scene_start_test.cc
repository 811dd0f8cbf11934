// A user's scene begins with the whole of its key frame, and what is open for viewing stands still.
#include "recorder/scene_start.h"

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <fstream>

#include "recorder/scene_origin.h"
#include "recorder/world.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

const std::filesystem::path kAssets = FLOWSCOPE_SOURCE_DIR "/assets";

/// A swinging arm with a sliding jaw; a gate with a motor, a filter's activation, a mocap body and a ball.
const std::string kGate =
    "<mujoco><compiler angle='radian'/><option gravity='0 0 0'/><worldbody>"
    "<body name='hand' pos='0 0 0.5'>"
    "<joint name='turn' type='hinge' axis='0 0 1' range='-1.5 1.5' limited='true'/>"
    "<geom type='capsule' size='0.02' fromto='0 0 0 0.3 0 0'/>"
    "<body name='jaw' pos='0.3 0 0'><joint name='grip' type='slide' axis='0 1 0'/>"
    "<geom type='box' size='0.01 0.01 0.01'/></body></body>"
    "<body name='gate' pos='1 0 0'><joint name='gate' axis='1 0 0' damping='1'/>"
    "<geom type='box' size='.02 .1 .005' pos='0 .1 0' mass='.2'/></body>"
    "<body name='fan' pos='2 0 0'><joint name='fan' axis='1 0 0' damping='1'/><geom size='0.1'/></body>"
    "<body name='stand' mocap='true' pos='3 0 0'><geom size='0.1'/></body>"
    "<body name='ball' pos='4 0 0'><freejoint/><geom size='0.1'/></body></worldbody>"
    "<actuator><position name='gate' joint='gate' kp='20'/>"
    "<general name='fan' joint='fan' dyntype='filter' dynprm='1' gainprm='2' biastype='affine' "
    "biasprm='0 -2 0'/>"
    "</actuator><keyframe>";
const std::string kBall = " 4 0 0 1 0 0 0";
const std::string kShut = "<key name='shut' qpos='0 0 0 0" + kBall + "'/>";
const std::string kOpen =
    "<key name='open' qpos='0 0 1.5 0.4" + kBall + "' ctrl='1.5 0.4' mpos='3 0.5 0.25' mquat='0 0 0 1'/>";
const std::string kFlying = "<key qpos='0 0 0 0.3" + kBall + "' qvel='0 0 0 0 0 0.1 0 0 0 0' act='0.3'/>";
const std::string kEnd = "</keyframe></mujoco>";
const std::string kRobot =
    "joints: [turn]\nstiffness: [500]\nhome: [0.25]\nhand: hand\n"
    "tool: {body: hand, position: [0.4, 0, 0], rpy_deg: [0, 90, 0]}\n"
    "attach: {body: hand, position: [0.4, 0, 0], rpy_deg: [0, 0, 0], size: [0.1, 0.1, 0.1]}\n"
    "inverse_kinematics: numeric\n"
    "limits: {velocity: 1, acceleration: 2, deceleration: 2}\n"
    "gripper: {squeeze: 0, fingers: [{joint: grip, stiffness: 100, open: 0.02, closed: 0}]}\n";

class SceneStart : public ::testing::Test {
 protected:
  std::string file(const std::string& name, const std::string& text) const {
    std::ofstream(folder_.path() / name) << text;
    return (folder_.path() / name).string();
  }
  SceneCall call(const std::string& keys, const std::string& key, bool with_robot = true) const {
    SceneCall result{file("gate.xml", kGate + keys + kEnd), "", ""};
    if (with_robot) result.robot = file("robot.yaml", kRobot);
    result.key = key;
    return result;
  }
  std::string complaint(const SceneCall& scene) const {
    try {
      open_scene(scene, kAssets);
    } catch (const BadScript& error) {
      return error.what();
    }
    return "";
  }
  testing::TemporaryFolder folder_;
};

double joint(const World& world, const char* name) {
  return world.data()->qpos[world.model()->jnt_qposadr[mj_name2id(world.model(), mjOBJ_JOINT, name)]];
}

TEST_F(SceneStart, ControlsAndPlacedBodiesAreTakenOver) {
  World world(open_scene(call(kOpen, ""), kAssets));
  EXPECT_NEAR(joint(world, "gate"), 1.5, 1e-3) << "its motor holds it while the scene comes to rest";
  EXPECT_NEAR(joint(world, "turn"), 0.25, 1e-3) << "the arm is at its home";
  const Pose stand = world.world_from("stand");
  EXPECT_LT((stand.position - Eigen::Vector3d(3, 0.5, 0.25)).norm(), 1e-9);
  EXPECT_NEAR(std::abs(stand.wxyz()[3]), 1, 1e-9);
  for (int i = 0; i < 20; ++i) world.advance({0.25}, 1);
  EXPECT_NEAR(joint(world, "gate"), 1.5, 1e-3) << "and later";
  world.reset(0, 1);
  EXPECT_NEAR(joint(world, "gate"), 1.5, 1e-3) << "and after a reset";
}

TEST_F(SceneStart, AMomentOfAMovementBeginsAsItStands) {
  World world(open_scene(call(kFlying, ""), kAssets));
  const SceneState state = world.state();
  EXPECT_EQ(state.qvel.at(5), 0.1);
  EXPECT_EQ(world.world_from("ball").position, Eigen::Vector3d(4, 0, 0));
  EXPECT_EQ(state.act, std::vector<double>{0.3});
  EXPECT_EQ(joint(world, "turn"), 0.25);
  EXPECT_EQ(world.world_from("stand").position, Eigen::Vector3d(3, 0, 0)) << "the key does not say";
  for (int i = 0; i < 20; ++i) world.advance({0.25}, 1);
  EXPECT_NEAR(world.world_from("ball").position.y(), 0.1, 1e-6) << "a second later";
}

TEST_F(SceneStart, OneOfSeveralIsChosenByNameOrNumber) {
  const std::string keys = kShut + kOpen + kFlying;
  const auto gate = [&](const std::string& key, bool with_robot) {
    return joint(World(open_scene(call(keys, key, with_robot), kAssets)), "gate");
  };
  for (const bool with_robot : {false, true}) {
    EXPECT_NEAR(gate("", with_robot), 0, 1e-3) << "the first";
    EXPECT_NEAR(gate("open", with_robot), 1.5, 1e-3);
    EXPECT_NEAR(gate("1", with_robot), 1.5, 1e-3);
    EXPECT_NEAR(gate("0", with_robot), 0, 1e-3);
  }
  EXPECT_EQ(World(open_scene(call(keys, "2"), kAssets)).state().qvel.at(5), 0.1) << "one without a name";
  const std::string said = complaint(call(keys, "opne"));
  EXPECT_NE(said.find("gate.xml: --key: there is no key frame 'opne' in it (known: shut, open, 2)"),
            std::string::npos)
      << said;
  EXPECT_NE(complaint(call("", "open")).find("it has none"), std::string::npos);
  EXPECT_NE(complaint(call(keys, "3")), "");
}

TEST_F(SceneStart, ADemonstrationsSceneIsOpenedWithItsKeyFrame) {
  const auto task = open_scene(call(kShut + kOpen, "open"), kAssets);
  const SceneOrigin origin = *task->origin().scene;
  EXPECT_EQ(origin.key, "open");
  EXPECT_NEAR(joint(World(open_again(origin, kAssets)), "gate"), 1.5, 1e-3);
}

TEST_F(SceneStart, WhatIsOpenForViewingStandsStill) {
  const std::string ball =
      "<mujoco><worldbody><body name='ball' pos='0 0 0.1'><freejoint/>"
      "<geom size='0.1'/></body></worldbody></mujoco>";
  World world(open_scene({file("ball.xml", ball), "", ""}, kAssets));
  EXPECT_EQ(world.world_from("ball").position, Eigen::Vector3d(0, 0, 0.1));
}

}  // namespace
}  // namespace flowscope
