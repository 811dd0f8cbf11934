// A robot's description that does not fit its scene is refused where it is wrong, with both names.
#include "recorder/robot_check.h"

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <fstream>

#include "recorder/scene_task.h"
#include "recorder/script.h"
#include "recorder/task_folder.h"
#include "recorder/world.h"
#include "tests/support/hand_models.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

using testing::arm_description;
using testing::arm_scene;
using testing::arm_servo;
using testing::arm_servos;
using testing::HandModel;
using testing::slide_hand;

/// `text` with the first `from` replaced; all of them with `everywhere`.
std::string with(std::string text, const std::string& from, const std::string& to, bool everywhere = false) {
  auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  for (; at != std::string::npos; at = everywhere ? text.find(from, at + to.size()) : std::string::npos) {
    text.replace(at, from.size(), to);
  }
  return text;
}

class RobotCheck : public ::testing::Test {
 protected:
  std::shared_ptr<const Task> open(const std::string& scene, const std::string& robot) const {
    std::ofstream(folder_.path() / "scene.xml") << scene;
    std::ofstream(folder_.path() / "arm.yaml") << robot;
    return open_scene({folder_.path() / "scene.xml", (folder_.path() / "arm.yaml").string(), ""},
                      FLOWSCOPE_SOURCE_DIR "/assets");
  }
  /// Without the folder in front.
  std::string complaint(const std::string& scene, const std::string& robot) const {
    try {
      open(scene, robot);
    } catch (const BadScript& error) {
      const std::string text = error.what(), folder = folder_.path().string() + "/";
      return text.starts_with(folder) ? text.substr(folder.size()) : text;
    }
    return "";
  }
  void expect(const std::string& complaint, const std::string& place,
              const std::vector<std::string>& words) const {
    EXPECT_EQ(complaint.rfind(place, 0), 0u) << complaint;
    for (const auto& word : words)
      EXPECT_NE(complaint.find(word), std::string::npos) << word << "\n" << complaint;
  }

  const HandModel hand_ = slide_hand();
  const std::string scene_ = arm_scene(hand_), robot_ = arm_description(hand_);
  testing::TemporaryFolder folder_;
};

TEST_F(RobotCheck, WhatFitsIsOpened) { EXPECT_EQ(complaint(scene_, robot_), ""); }

TEST_F(RobotCheck, NamesThatTheSceneLacksAreOfferedWithTheirKind) {
  expect(complaint(scene_, with(robot_, "j3", "joint3")),
         "arm.yaml:1:18: ", {"no joint 'joint3'", "known: j1, j2"});
  expect(complaint(scene_, with(robot_, "a2", "A2")),
         "arm.yaml:2:17: ", {"no actuator 'A2'", "did you mean a2"});
  expect(complaint(scene_, with(robot_, "a2", "j2")),
         "arm.yaml:2:17: ", {"no actuator 'j2'", "'j2' is a joint there"});
  expect(complaint(scene_, with(robot_, "tcp", "left/tcp")),
         "arm.yaml:4:7: ", {"no site 'left/tcp'", "mean tcp"});
  expect(complaint(scene_, with(robot_, "grip_box", "gripbox")),
         "arm.yaml:5:9: ", {"no site", "mean grip_box"});
  expect(complaint(scene_, with(robot_, "hand: hand", "hand: hnd")),
         "arm.yaml:6:7: ", {"no body 'hnd'", "mean hand"});
  expect(complaint(scene_, with(robot_, "joint: f2", "joint: f3")),
         "arm.yaml:12:15: ", {"no joint 'f3'", "f2"});
  expect(complaint(scene_, with(robot_, "grip,", "gripper,")),
         "arm.yaml:11:29: ", {"no actuator 'gripper'", "grip"});
  expect(complaint(scene_, with(robot_, "tool: tcp",
                                "tool: {body: Hand, position: [0, 0, 0.1], rpy_deg: [0, 0, 0]}")),
         "arm.yaml:4:7: ", {"no body 'Hand'", "mean hand"});
}

TEST_F(RobotCheck, EachActuatorMovesItsOwnJoint) {
  expect(complaint(scene_, with(robot_, "[a1, a2,", "[a2, a1,")),
         "arm.yaml:2:13: ", {"a2 moves j2, not j1", "a1 does"});
  expect(complaint(scene_, with(robot_, "a6]", "grip]")), "arm.yaml:11:29: ", {"grip", "twice"});
  expect(complaint(with(scene_, "joint='j4'", "joint='j5'"), robot_),
         "arm.yaml:2:25: ", {"a4 moves j5, not j4"});
  const std::string tendon =
      with(with(scene_, "<tendon>", "<tendon><fixed name='rope'><joint joint='j3' coef='1'/></fixed>"),
           "joint='j3' biastype", "tendon='rope' biastype");
  expect(complaint(tendon, robot_), "arm.yaml:2:21: ", {"a3 moves tendon rope, not j3"});
  expect(complaint(with(scene_, "joint='j3' biastype", "joint='j3' gear='50' biastype"), robot_),
         "arm.yaml:2:21: ", {"a3", "j3", "gear of 50", "stiffness"});
  expect(complaint(scene_, with(robot_, "f1, actuator: grip", "f1, actuator: a6")),
         "arm.yaml:11:29: ", {"'a6'", "twice"});
}

TEST_F(RobotCheck, ArmActuatorsArePositionServos) {
  // The last one, as the engine wants those with a state of their own to be.
  const auto driven_by = [this](const std::string& third) {
    HandModel hand = hand_;
    hand.actuator += third;
    return arm_scene(hand, with(arm_servos(), arm_servo("j3", "a3"), ""));
  };
  const struct {
    const char *actuator, *says;
  } kinds[] = {
      {"<motor name='a3' joint='j3' ctrlrange='-80 80'/>", "is a motor: its input is a force"},
      {"<velocity name='a3' joint='j3' kv='100'/>", "is a velocity servo: its input is a speed"},
      {"<general name='a3' joint='j3' dyntype='integrator' gainprm='100' biastype='affine' biasprm='0 -100 "
       "0'/>",
       "that is a speed"},
      {"<cylinder name='a3' joint='j3' timeconst='1'/>", "delay"},
      {"<muscle name='a3' joint='j3' lengthrange='0.5 1'/>", "muscle"},
      {"<general name='a3' joint='j3' gainprm='35' biastype='affine' biasprm='0 -2000 -10'/>", "0.0175 rad"},
      {"<general name='a3' joint='j3' gainprm='2000' biastype='affine' biasprm='100 -2000 -10'/>",
       "0 for 0.05 rad"},
      {"<general name='a3' joint='j3' gainprm='2000' biastype='affine' biasprm='0 2000 0'/>", "pushes away"},
      {"<position name='a3' joint='j3' kp='2000' forcerange='0 80'/>", "push both ways"},
  };
  for (const auto& [actuator, says] : kinds) {
    expect(complaint(driven_by(actuator), robot_), "arm.yaml:2:21: ", {"'a3'", "j3", says});
  }
  EXPECT_EQ(complaint(driven_by("<position name='a3' joint='j3' kp='2000' forcerange='-80 80'/>"), robot_),
            "");
  expect(complaint(arm_scene(hand_, arm_servos() + "<position name='extra' joint='j2' kp='100'/>"), robot_),
         "arm.yaml:2:12: ", {"'extra' holds j2"});
  expect(complaint(driven_by("<position name='a3' joint='j3' kp='2000' ctrlrange='-1 1'/>"), robot_),
         "arm.yaml:3:16: ", {"home: 1.4 rad", "inputs of a3", "\u22121\u20261"});
}

TEST_F(RobotCheck, WithAStiffnessOtherActuatorsOfTheJointsDoNotCount) {
  std::string servos;
  for (const std::string i : {"1", "2", "3", "4", "5", "6"}) {
    servos += "<velocity name='a" + i + "' joint='j" + i + "' kv='100'/>";
  }
  const std::string robot =
      with(robot_, "actuators: [a1, a2, a3, a4, a5, a6]", "stiffness: [2000, 2000, 2000, 2000, 2000, 2000]");
  World world(open(arm_scene(hand_, servos), robot));
  auto target = world.joint_targets();
  target[2] += 0.2;
  for (int i = 0; i < 30; ++i) world.advance(target, 1);
  EXPECT_NEAR(world.frame().q[2], target[2], 0.002);
}

TEST_F(RobotCheck, HomeLiesInsideTheRanges) {
  expect(complaint(scene_, with(robot_, "home: [0, 0.4, 1.4,", "home: [0, 35, 70,")),
         "arm.yaml:3:11: ", {"home: 35 rad lies outside j2's \u22122\u20262: degrees?"});
  const std::string small = complaint(scene_, with(robot_, "home: [0, 0.4,", "home: [0, -2.1,"));
  expect(small, "arm.yaml:3:11: ", {"home: \u22122.1 rad lies outside j2's \u22122\u20262"});
  const std::string unlimited = with(scene_, "axis='0 0 1' range='-3 3'", "axis='0 0 1'");
  expect(complaint(unlimited, with(robot_, "home: [0,", "home: [90,")), "arm.yaml:3:8: ", {"j1", "degrees?"});
}

TEST_F(RobotCheck, RangesThatTheCompilerTakesForDegreesAreSuspected) {
  expect(complaint(with(scene_, "angle='radian' ", ""), robot_),
         "arm.yaml:3:11: ", {"home: 0.4 rad", "<compiler>"});
}

TEST_F(RobotCheck, ATasksOwnRobotIsHeldAgainstItsSceneToo) {
  const std::filesystem::path tasks = FLOWSCOPE_SOURCE_DIR "/assets/tasks",
                              folder = folder_.path() / "push_buttons";
  std::filesystem::copy(tasks / "push_buttons", folder);
  std::ofstream(folder / "task.yaml", std::ios::app) << "\nrobot: mine.yaml\n";
  std::ifstream panda(FLOWSCOPE_SOURCE_DIR "/assets/robots/panda.yaml");
  const std::string text{std::istreambuf_iterator<char>(panda), {}};
  std::ofstream(folder / "mine.yaml") << with(text, "actuator1, actuator2", "actuator2, actuator1");
  try {
    load_task(folder, FLOWSCOPE_SOURCE_DIR "/assets");
    FAIL();
  } catch (const BadScript& error) {
    expect(error.what(), (folder / "mine.yaml:3:13: ").string(), {"actuator2 moves joint2, not joint1"});
  }
}

TEST_F(RobotCheck, TheArmIsOneChainThatEndsAtTheTool) {
  expect(complaint(scene_, with(with(robot_, "[j1, j2,", "[j2, j1,"), "[a1, a2,", "[a2, a1,")),
         "arm.yaml:1:14: ", {"j1 lies above j2", "from the base to the flange"});
  const std::string short_arm = with(with(with(robot_, "j1, ", ""), "a1, ", ""), "[0, 0.4", "[0.4");
  expect(complaint(scene_, short_arm), "arm.yaml:1:9: ", {"joint 'j1' moves the tool", "does not name it"});
  const std::string other = "<body name='turntable' pos='1 0 0'><joint name='turn'/><geom size='.1'/></body>";
  expect(complaint(arm_scene(hand_, arm_servos() + arm_servo("turn", "t"), other),
                   with(with(robot_, "j6]", "turn]"), "a6]", "t]")),
         "arm.yaml:1:30: ", {"turn does not hang below j5"});
  expect(complaint(arm_scene(hand_, arm_servos(), "<site name='mark'/>"),
                   with(robot_, "tool: tcp", "tool: mark")),
         "arm.yaml:4:7: ", {"'tool'", "j6, does not move"});
  expect(complaint(scene_, with(robot_, "hand: hand", "hand: l3")),
         "arm.yaml:6:7: ", {"'hand' is of body l3", "j6"});
  expect(complaint(scene_, with(robot_, "hand: hand", "hand: lf")),
         "arm.yaml:1:9: ", {"joint 'f1'", "moves the hand"});
  expect(complaint(with(scene_, "type='box' size='.012 .03 .02'", "size='.02'"), robot_),
         "arm.yaml:5:9: ", {"grip_box", "no box"});
  expect(complaint(with(scene_, "<joint name='j4' axis='0 0 1' range='-3 3'",
                        "<joint name='j4' type='ball' range='0 3'"),
                   robot_),
         "arm.yaml:1:22: ", {"'j4' is a ball joint", "hinges"});
  expect(complaint(scene_, with(with(robot_, "j6]", "f1]"), "joint: f1", "joint: j6")),
         "arm.yaml:1:30: ", {"'f1' is a slide"});
}

TEST_F(RobotCheck, NothingElseHoldsTheArm) {
  const std::string target = "<body name='target' mocap='true' pos='.3 0 .4'/>";
  const auto tied = [&](const std::string& equality) {
    return complaint(arm_scene(hand_, arm_servos(), target, equality), robot_);
  };
  expect(tied("<weld body1='target' body2='hand'/>"),
         "arm.yaml:1:9: ", {"body 'hand'", "mocap body 'target'", "weld", "active=\"false\""});
  expect(tied("<connect body1='l4' body2='target' anchor='0 0 0'/>"),
         "arm.yaml:1:9: ", {"'l4'", "'target'", "connect"});
  expect(tied("<weld body1='hand' body2='base'/>"), "arm.yaml:1:9: ", {"'hand'", "'base'"});
  EXPECT_EQ(tied("<weld body1='target' body2='hand' active='false'/>"), "");
  EXPECT_EQ(tied("<weld body1='target' body2='cube'/>"), "");
  expect(tied("<joint joint1='j4' joint2='j2'/>"), "arm.yaml:1:22: ", {"ties j4 to j2"});
  expect(tied("<joint joint1='j4'/>"), "arm.yaml:1:22: ", {"locks j4"});
  const auto flagged = [&](const std::string& flag) {
    return complaint(with(scene_, "<option timestep='.002'/>", "<option><flag " + flag + "/></option>"),
                     robot_);
  };
  expect(flagged("actuation='disable'"), "arm.yaml:2:12: ", {"actuation"});
  expect(flagged("equality='disable'"), "arm.yaml:6:7: ", {"equality"});
}

TEST_F(RobotCheck, FingersStayInsideTheirRanges) {
  expect(complaint(scene_, with(robot_, "open: 0.04", "open: 40")),
         "arm.yaml:11:41: ", {"open: 40 m lies outside f1's 0\u20260.04"});
  const std::string direct = with(with(scene_, "tendon='split' forcerange", "joint='f1' forcerange"),
                                  "ctrlrange='0 255'", "ctrlrange='0 .04'");
  const std::string plain = with(robot_, ", command_open: 255, command_closed: 0", "");
  expect(complaint(direct, with(plain, "open: 0.04", "open: 40")), "arm.yaml:11:41: ", {"mm?"});
  expect(complaint(scene_, with(plain, "open: 0.04", "open: 255")),
         "arm.yaml:11:41: ", {"f1", "grip", "'command_open: 255'"});
  expect(complaint(scene_,
                   with(robot_, "{joint: f2, open: 0.04, closed: 0", "{joint: f2, open: 0.04, closed: -5")),
         "arm.yaml:12:39: ", {"closed: \u22125 m", "f2"});
  HandModel unlimited = hand_;
  unlimited.fingers = with(hand_.fingers, " range='0 .04'", "", true);
  expect(complaint(arm_scene(unlimited), with(robot_, "open: 0.04", "open: 40", true)),
         "arm.yaml:11:41: ", {"mm?"});
}

TEST_F(RobotCheck, InputsThatOpenAndCloseDoSo) {
  const std::string plain = with(robot_, ", command_open: 255, command_closed: 0", "");
  expect(complaint(scene_, plain), "arm.yaml:11:41: ",
         {"0.04", "grip", "0\u2026255", "f1", "'command_open: 255' and 'command_closed: 0' would do it"});
  expect(complaint(scene_, with(robot_, "command_open: 255, command_closed: 0",
                                "command_open: 0, command_closed: 255")),
         "arm.yaml:11:72: ", {"grip", "f1 open", "command_open: 255"});
  expect(complaint(scene_, with(robot_, "command_open: 255", "command_open: 1000")),
         "arm.yaml:11:72: ", {"1000 lies outside the inputs of grip", "0\u2026255"});
  expect(complaint(scene_, with(robot_, "command_open: 255", "command_open: 100")),
         "arm.yaml:11:72: ", {"100", "0.04"});
  const std::string direct = with(scene_, "tendon='split'", "joint='f1'");
  EXPECT_EQ(complaint(direct, robot_), "");
  const std::string no_range = with(direct, " ctrlrange='0 255'", "");
  expect(complaint(no_range, with(robot_, "command_open: 255", "command_open: 100000")),
         "arm.yaml:11:72: ", {"grip"});
}

TEST_F(RobotCheck, FingerActuatorsAreServosOfTheFingers) {
  expect(complaint(with(scene_, "tendon='split'", "joint='j6'"), robot_),
         "arm.yaml:11:29: ", {"grip moves j6, not f1"});
  expect(complaint(with(scene_, "biastype='affine' biasprm='0 -100 -10'", ""), robot_),
         "arm.yaml:11:29: ", {"'grip' of finger f1 is a motor", "stiffness"});
  const std::string twin = arm_scene(hand_, arm_servos() + "<position name='other' joint='f2' kp='100'/>");
  expect(complaint(twin, robot_), "arm.yaml:12:15: ", {"'other'", "'f2'"});
}

TEST_F(RobotCheck, AFingerThatNothingHoldsIsRefused) {
  HandModel loose = hand_;
  loose.equality.clear();
  expect(complaint(arm_scene(loose), robot_), "arm.yaml:11:29: ", {"f1", "f2", "no equality"});
  const std::string direct =
      with(with(arm_scene(loose), "tendon='split'", "joint='f1'"), " ctrlrange='0 255'", "");
  expect(complaint(direct, robot_),
         "arm.yaml:12:15: ", {"'f2' has no actuator", "<joint joint1=\"f2\" joint2=\"f1\"/>", "mimic"});
  const std::string unnamed = with(robot_, "    - {joint: f2, open: 0.04, closed: 0}\n", "");
  expect(complaint(direct, unnamed), "arm.yaml:10:3: ", {"joint 'f2' of the hand is loose", "f1"});
  EXPECT_EQ(
      complaint(with(direct, "name='f2' type='slide'", "name='f2' type='slide' stiffness='100'"), unnamed),
      "");
  HandModel off = hand_;
  off.equality = with(hand_.equality, "<joint ", "<joint active='false' ");
  expect(complaint(arm_scene(off), robot_), "arm.yaml:11:29: ", {"f1", "f2"});
  HandModel opposed = hand_;
  opposed.equality = with(hand_.equality, "<joint ", "<joint polycoef='0 -1 0 0 0' ");
  expect(complaint(arm_scene(opposed), robot_), "arm.yaml:1", {"f1", "f2"});
}

TEST_F(RobotCheck, OpenIsWiderThanClosed) {
  const std::string exchanged =
      with(with(robot_, "open: 0.04, closed: 0, command_open: 255, command_closed: 0",
                "open: 0, closed: 0.04, command_open: 0, command_closed: 255"),
           "{joint: f2, open: 0.04, closed: 0}", "{joint: f2, open: 0, closed: 0.04}");
  expect(complaint(scene_, exchanged), "arm.yaml:11:41: ", {"f1", "6 mm", "46 mm", "exchanged"});
}

TEST_F(RobotCheck, NumbersThatMeanAnotherUnitAreRefused) {
  expect(complaint(scene_, with(robot_, "velocity: 1.5", "velocity: 90")),
         "arm.yaml:8:20: ", {"rad/s", "degrees?"});
  expect(complaint(scene_, with(robot_, "squeeze: 0.002", "squeeze: 2")),
         "arm.yaml:13:12: ", {"f1", "squeeze"});
  expect(complaint(scene_,
                   with(robot_, "tool: tcp", "tool: {body: hand, position: [0, 0, 90], rpy_deg: [0, 0, 0]}")),
         "arm.yaml:4:30: ", {"metres", "mm?"});
  expect(complaint(scene_, with(robot_, "[j1, j2", "[j1, j1")), "arm.yaml:1:14: ", {"'j1' is named twice"});
  expect(complaint(scene_, with(robot_, "joint: f2", "joint: j2")),
         "arm.yaml:12:15: ", {"'j2' is named twice"});
  expect(complaint(scene_, with(robot_, ", command_closed: 0", "")), "arm.yaml:11:72: ", {"go together"});
}

}  // namespace
}  // namespace flowscope
