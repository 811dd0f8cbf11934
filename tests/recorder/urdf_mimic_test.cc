#include "recorder/urdf_mimic.h"

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <fstream>

#include "recorder/scene_task.h"
#include "recorder/script.h"
#include "recorder/world.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

/// Two arm joints, and fingers of which the second one goes twice as far as the first, 5 mm ahead.
std::string urdf(const std::string& mimic = "<mimic joint='f1' multiplier='-2' offset='0.005'/>") {
  const auto link = [](const std::string& name, const std::string& size) {
    return "<link name='" + name +
           "'><inertial><origin xyz='0 0 0.02'/><mass value='0.2'/><inertia ixx='0.001' "
           "iyy='0.001' izz='0.001' ixy='0' ixz='0' iyz='0'/></inertial><collision><geometry><box size='" +
           size + "'/></geometry></collision></link>\n";
  };
  const auto joint = [](const std::string& name, const std::string& type, const std::string& parent,
                        const std::string& child, const std::string& place, const std::string& range,
                        const std::string& more) {
    return "<joint name='" + name + "' type='" + type + "'><parent link='" + parent + "'/><child link='" +
           child + "'/><origin xyz='" + place + "'/><axis xyz='0 1 0'/><limit " + range +
           " effort='50' velocity='2'/>\n" + more + "</joint>\n";
  };
  return "<?xml version='1.0'?>\n<robot name='arm'>\n" + link("base", "0.1 0.1 0.02") +
         link("l1", "0.02 0.02 0.1") + link("l2", "0.02 0.02 0.1") + link("lf", "0.01 0.005 0.03") +
         link("rf", "0.01 0.005 0.03") +
         joint("j1", "revolute", "base", "l1", "0 0 0.2", "lower='-2' upper='2'", "") +
         joint("j2", "revolute", "l1", "l2", "0 0 0.2", "lower='-2' upper='2'", "") +
         joint("f1", "prismatic", "l2", "lf", "0 0.03 0.1", "lower='0' upper='0.02'", "") +
         joint("f2", "prismatic", "l2", "rf", "0 -0.03 0.1", "lower='-0.04' upper='0.01'", mimic) +
         "</robot>\n";
}

const std::string kRobot =
    "joints: [j1, j2]\nstiffness: [500, 500]\nhome: [0.2, 0.2]\nhand: l2\n"
    "tool: {body: l2, position: [0, 0, 0.1], rpy_deg: [0, 0, 0]}\n"
    "attach: {body: l2, position: [0, 0, 0.1], rpy_deg: [0, 0, 0], size: [0.02, 0.05, 0.02]}\n"
    "inverse_kinematics: numeric\nlimits: {velocity: 1, acceleration: 2, deceleration: 2}\n"
    "gripper:\n  fingers:\n    - {joint: f1, stiffness: 500, open: 0.02, closed: 0}\n"
    "    - {joint: f2, open: -0.035, closed: 0.005}\n  squeeze: 0.001\n";

class Mimic : public ::testing::Test {
 protected:
  std::shared_ptr<const Task> open(const std::string& text, const std::string& robot) const {
    std::ofstream(folder_.path() / "arm.urdf") << text;
    std::ofstream(folder_.path() / "arm.yaml") << robot;
    return open_scene(
        {folder_.path() / "arm.urdf", robot.empty() ? "" : (folder_.path() / "arm.yaml").string(), ""},
        FLOWSCOPE_SOURCE_DIR "/assets");
  }
  std::string complaint(const std::string& text, const std::string& robot) const {
    try {
      open(text, robot);
    } catch (const BadScript& error) {
      return error.what();
    }
    return "";
  }
  testing::TemporaryFolder folder_;
};

TEST_F(Mimic, BecomesAnEqualityWithMultiplierAndOffset) {
  World world(open(urdf(), kRobot));
  const auto at = [&](const char* name) {
    return world.data()->qpos[world.model()->jnt_qposadr[mj_name2id(world.model(), mjOBJ_JOINT, name)]];
  };
  for (const double openness : {0.0, 0.4, 1.0}) {
    for (int i = 0; i < 20; ++i) world.advance(world.joint_targets(), openness);
    EXPECT_NEAR(at("f1"), 0.02 * openness, 0.0005);
    EXPECT_NEAR(at("f2"), 0.005 - 2 * at("f1"), 0.0005) << openness;
  }
}

TEST_F(Mimic, HoldsInASceneForViewingToo) {
  World world(open(urdf(), ""));
  const mjModel* model = world.model();
  const int f1 = model->jnt_qposadr[mj_name2id(model, mjOBJ_JOINT, "f1")];
  const int f2 = model->jnt_qposadr[mj_name2id(model, mjOBJ_JOINT, "f2")];
  for (int i = 0; i < 20; ++i) world.advance({}, 1);
  EXPECT_NEAR(world.data()->qpos[f2], 0.005 - 2 * world.data()->qpos[f1], 0.001);
}

TEST_F(Mimic, AFingerWithoutItIsRefused) {
  const std::string said = complaint(urdf(""), kRobot);
  EXPECT_NE(said.find("arm.yaml:12:15: finger 'f2' has no actuator"), std::string::npos) << said;
  EXPECT_NE(said.find("mimic"), std::string::npos);
}

TEST_F(Mimic, MistakesNameTheLineOfTheUrdf) {
  const auto says = [&](const std::string& mimic) { return complaint(urdf(mimic), ""); };
  const std::string line = ":15: joint 'f2' ";
  std::string said = says("<mimic joint='f9'/>");
  EXPECT_NE(said.find("arm.urdf" + line + "mimics 'f9'"), std::string::npos) << said;
  EXPECT_NE(said.find("known: j1, j2, f1, f2"), std::string::npos) << said;
  said = says("<mimic joint='f1' multiplier='twice'/>");
  EXPECT_NE(said.find("arm.urdf" + line), std::string::npos) << said;
  EXPECT_NE(said.find("multiplier of 'twice'"), std::string::npos) << said;
  said = says("<mimic joint='f2'/>");
  EXPECT_NE(said.find("mimics itself"), std::string::npos) << said;
  EXPECT_EQ(says("<mimic joint='f1'/>"), "");
}

TEST_F(Mimic, AnArmJointThatFollowsAnotherIsRefused) {
  std::string text = urdf();
  const std::string name = "<joint name='j2' type='revolute'>";
  text.replace(text.find(name), name.size(), name + "<mimic joint='j1'/>");
  const std::string said = complaint(text, kRobot);
  EXPECT_NE(said.find("arm.yaml:1:14: an equality of the scene ties j2 to j1"), std::string::npos) << said;
}

}  // namespace
}  // namespace flowscope
