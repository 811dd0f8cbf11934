#include "recorder/scene_task.h"

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <cmath>
#include <fstream>

#include "recorder/record.h"
#include "recorder/world.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

const std::filesystem::path kAssets = FLOWSCOPE_SOURCE_DIR "/assets";

/// Six hinges, 15 cm apart, and a sliding finger.
std::string arm_urdf() {
  const auto link = [](const std::string& name) {
    return "<link name='" + name +
           "'><inertial><mass value='1'/><inertia ixx='0.01' iyy='0.01' izz='0.01' ixy='0' ixz='0' iyz='0'/>"
           "</inertial><visual><geometry><cylinder radius='0.03' length='0.1'/></geometry></visual></link>";
  };
  std::string text = "<?xml version='1.0'?>\n<!-- <x> --><robot name='arm'>" + link("l0");
  const char* axes[] = {"0 0 1", "0 1 0", "0 1 0", "0 0 1", "0 1 0", "0 0 1"};
  for (int i = 1; i <= 6; ++i) {
    const std::string k = std::to_string(i), before = std::to_string(i - 1);
    text += link("l" + k) + "<joint name='j" + k + "' type='revolute'><parent link='l" + before +
            "'/><child link='l" + k + "'/><origin xyz='0 0 0.15'/><axis xyz='" + axes[i - 1] +
            "'/><limit lower='-3' upper='3' effort='100' velocity='2'/></joint>";
  }
  text += link("finger") +
          "<joint name='slide' type='prismatic'><parent link='l6'/><child link='finger'/><origin xyz='0 0.05 "
          "0.1'/>"
          "<axis xyz='0 1 0'/><limit lower='0' upper='0.05' effort='20' velocity='1'/></joint>";
  // A frame without mass, as such files have them.
  text +=
      "<link name='tcp'/><joint name='fixed' type='fixed'><parent link='l6'/><child link='tcp'/>"
      "<origin xyz='0 0 0.15'/></joint>";
  return text + "</robot>";
}

const std::string kArm =
    "joints: [j1, j2, j3, j4, j5, j6]\n"
    "stiffness: [2000, 2000, 2000, 1000, 1000, 1000]\n"
    "home: [0, 0.5, 1, 0, 0.8, 0]\n"
    "tool: {body: tcp, position: [0, 0, 0], rpy_deg: [0, 0, 0]}\n"
    "attach: {body: tcp, position: [0, 0, -0.02], rpy_deg: [0, 0, 0], size: [0.04, 0.1, 0.06]}\n"
    "hand: l6\n"
    "inverse_kinematics: numeric\n"
    "limits: {velocity: 1.5, acceleration: 6, deceleration: 3}\n"
    "gripper:\n"
    "  fingers: [{joint: slide, stiffness: 500, open: 0.05, closed: 0}]\n"
    "  squeeze: 0.0005\n";

const std::string kTetrahedron =
    "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";

const std::string kDesk =
    "<mujoco><option timestep='0.003'/><asset><mesh name='part' file='meshes/part.obj'/></asset><worldbody>"
    "<geom type='plane' size='2 2 0.1'/><camera name='eye' pos='1 0 1'/><light pos='0 0 2'/>"
    "<body name='part' pos='0 0 0.3'><freejoint/><geom type='mesh' mesh='part'/></body>"
    "</worldbody><keyframe><key qpos='0.5 0 0.4 1 0 0 0'/></keyframe></mujoco>";

class Scene : public ::testing::Test {
 protected:
  std::filesystem::path file(const std::string& name, const std::string& text) const {
    const auto path = folder_.path() / name;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path) << text;
    return path;
  }
  std::string complaint(const SceneCall& call) const {
    try {
      open_scene(call, kAssets);
    } catch (const BadScript& error) {
      return error.what();
    }
    return "";
  }
  testing::TemporaryFolder folder_;
};

TEST_F(Scene, AnMjcfOpensForViewing) {
  file("meshes/part.obj", kTetrahedron);
  const auto task = open_scene({file("my desk.xml", kDesk), "", "look"}, kAssets);
  EXPECT_EQ(task->name(), "my_desk");
  EXPECT_EQ(task->instructions(0), std::vector<std::string>{"look"});
  EXPECT_EQ(open_scene({file("My_other desk-2.xml", kDesk), "", ""}, kAssets)->instructions(0),
            std::vector<std::string>{"my other desk 2"})
      << "a policy must read something";
  EXPECT_EQ(open_scene({file("__.xml", kDesk), "", ""}, kAssets)->instructions(0),
            std::vector<std::string>{"scene"});
  EXPECT_EQ(observation_cameras(task->model()), std::vector<std::string>{"eye"});
  EXPECT_EQ(task->model()->nlight, 1);
  World world(task);
  EXPECT_LT((world.world_from("part").position - Eigen::Vector3d(0.5, 0, 0.4)).norm(), 1e-12)
      << "it begins with its key frame, and nothing falls while one looks";
  EXPECT_NEAR(world.advance({}, 1).time_s, 0.05, 1e-9);
  const RunReport report = run_script(world, parse_script("steps: [{gripper: close}]"), {});
  EXPECT_FALSE(report.success);
  EXPECT_NE(report.reason.find("open for viewing"), std::string::npos) << report.reason;
}

TEST_F(Scene, AUrdfArmMovesWithItsDescription) {
  const auto robot = file("arm.yaml", kArm);
  const auto task = open_scene({file("arm.urdf", arm_urdf()), robot, ""}, kAssets);
  EXPECT_EQ(observation_cameras(task->model()),
            (std::vector<std::string>{"front", "left_shoulder", "right_shoulder", "wrist"}));
  EXPECT_EQ(task->model()->nlight, 2);
  World world(task);
  const Pose before = world.frame().world_from_tool;
  const Script script = parse_script(
      "steps:\n"
      "- move: {frame: tool, position: [0.05, 0, -0.05], rpy_deg: [0, 0, 20], path: linear}\n"
      "- gripper: close\n");
  const RunReport report = run_script(world, script, [](const SceneState&) { return Observation{}; });
  EXPECT_TRUE(report.success) << report.reason;
  ASSERT_TRUE(report.demo);
  EXPECT_EQ(report.demo->info.task, "arm");
  EXPECT_GE(report.demo->info.keyframes, 1);
  const Pose moved = before.inverse() * world.frame().world_from_tool;
  EXPECT_LT((moved.position - Eigen::Vector3d(0.05, 0, -0.05)).norm(), 0.003);
  const auto q = world.joint_targets();
  for (int i = 0; i < 5; ++i) world.advance(q, 0);
  EXPECT_LT(world.frame().openness, 0.1);
  EXPECT_EQ(world.frame().q[6], 0);
}

TEST_F(Scene, TheHandTakesWhatIsLoose) {
  const auto scene = file(
      "swing.xml",
      "<mujoco><compiler angle='radian'/><option gravity='0 0 0'/><worldbody><body name='hand' pos='0 0 0.5'>"
      "<joint name='turn' type='hinge' axis='0 0 1' range='-1.5 1.5' limited='true'/>"
      "<geom type='capsule' size='0.02' fromto='0 0 0 0.3 0 0'/>"
      "<body name='jaw' pos='0.3 0 0'><joint name='grip' type='slide' axis='0 1 0'/>"
      "<geom type='box' size='0.01 0.01 0.01'/></body></body>"
      "<body pos='0.4 0 0.5'><freejoint/><geom type='sphere' size='0.02'/></body>"
      "<body name='far' pos='0.4 0.3 0.5'><freejoint/><geom type='sphere' size='0.02'/>"
      "</body></worldbody></mujoco>");
  const auto robot =
      file("swing.yaml",
           "joints: [turn]\nstiffness: [500]\nhome: [0]\nhand: hand\n"
           "tool: {body: hand, position: [0.4, 0, 0], rpy_deg: [0, 90, 0]}\n"
           "attach: {body: hand, position: [0.4, 0, 0], rpy_deg: [0, 0, 0], size: [0.1, 0.1, 0.1]}\n"
           "inverse_kinematics: numeric\n"
           "limits: {velocity: 1, acceleration: 2, deceleration: 2}\n"
           "gripper: {squeeze: 0, fingers: [{joint: grip, stiffness: 100, open: 0.02, closed: 0}]}\n");
  World world(open_scene({scene, robot, ""}, kAssets));
  world.grasp();
  ASSERT_EQ(world.grasped(), std::vector<std::string>{"object_1"}) << "the nameless one; the other is far";
  for (int i = 1; i <= 20; ++i) world.advance({0.05 * i}, 1);
  for (int i = 0; i < 5; ++i) world.advance({1.0}, 1);
  const Eigen::Vector3d ball = world.world_from("object_1").position;
  EXPECT_LT((ball - Eigen::Vector3d(0.4 * std::cos(1.0), 0.4 * std::sin(1.0), 0.5)).norm(), 0.005);
}

TEST_F(Scene, BrokenFilesAreNamed) {
  const auto broken = file("broken.xml", "<mujoco><worldbody><geom type='ball'/></worldbody></mujoco>");
  EXPECT_EQ(complaint({broken, "", ""}).rfind(broken.string() + ":1: ", 0), 0u);
  EXPECT_NE(complaint({broken, "", ""}).find("geom"), std::string::npos);
  const auto no_xml = file("no.urdf", "<robot name='x'><link");
  EXPECT_EQ(complaint({no_xml, "", ""}).rfind(no_xml.string() + ":1: ", 0), 0u);
  const auto none = folder_.path() / "none.xml";
  EXPECT_NE(complaint({none, "", ""}).find("none.xml"), std::string::npos);
  const auto missing_mesh = file("mesh.xml", kDesk);
  EXPECT_NE(complaint({missing_mesh, "", ""}).find("part.obj"), std::string::npos);
}

TEST_F(Scene, AUrdfsMeshesAreFoundWhereItNamesThem) {
  file("arm/meshes/part.obj", kTetrahedron);
  for (const std::string name : {"../meshes/part.obj", "package://arm/meshes/part.obj"}) {
    const auto urdf =
        file("arm/urdf/arm.urdf", "<robot name='arm'><link name='a'><visual><geometry><mesh filename='" +
                                      name + "'/></geometry></visual></link></robot>");
    EXPECT_EQ(open_scene({urdf, "", ""}, kAssets)->model()->nmesh, 1) << name;
  }
}

TEST_F(Scene, ADescriptionThatDoesNotFitIsNamed) {
  const auto urdf = file("arm.urdf", arm_urdf());
  std::string text = kArm;
  text.replace(text.find("j3"), 2, "jx");
  EXPECT_NE(complaint({urdf, file("a.yaml", text), ""}).find("no joint 'jx'"), std::string::npos);
  text = kArm;
  text.replace(text.find("body: tcp"), 9, "body: tip");
  const std::string said = complaint({urdf, file("b.yaml", text), ""});
  EXPECT_NE(said.find("b.yaml:4:7: the scene has no body 'tip'; did you mean tcp? (known: "),
            std::string::npos)
      << said;
  text = kArm;
  text.replace(text.find("hand: l6"), 8, "hands: l6");
  EXPECT_NE(complaint({urdf, file("c.yaml", text), ""}).find("c.yaml:6:"), std::string::npos);
}

}  // namespace
}  // namespace flowscope
