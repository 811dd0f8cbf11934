// A user's own scene is found again, or what is missing or has changed is named.
#include "recorder/scene_origin.h"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

const std::filesystem::path kAssets = FLOWSCOPE_SOURCE_DIR "/assets";

const std::string kSwing =
    "<mujoco><compiler angle='radian'/><asset><mesh name='part' file='part.obj'/></asset><worldbody>"
    "<body name='hand' pos='0 0 0.5'>"
    "<joint name='turn' type='hinge' axis='0 0 1' range='-1.5 1.5' limited='true'/>"
    "<geom type='capsule' size='0.02' fromto='0 0 0 0.3 0 0'/>"
    "<body name='jaw' pos='0.3 0 0'><joint name='grip' type='slide' axis='0 1 0'/>"
    "<geom type='box' size='0.01 0.01 0.01'/></body></body>"
    "<geom type='mesh' mesh='part' pos='0 1 0'/></worldbody></mujoco>";
const std::string kRobot =
    "joints: [turn]\nstiffness: [500]\nhome: [0]\nhand: hand\n"
    "tool: {body: hand, position: [0.4, 0, 0], rpy_deg: [0, 90, 0]}\n"
    "attach: {body: hand, position: [0.4, 0, 0], rpy_deg: [0, 0, 0], size: [0.1, 0.1, 0.1]}\n"
    "inverse_kinematics: numeric\n"
    "limits: {velocity: 1, acceleration: 2, deceleration: 2}\n"
    "gripper: {squeeze: 0, fingers: [{joint: grip, stiffness: 100, open: 0.02, closed: 0}]}\n";
const std::string kMesh = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";

class SceneOriginTest : public ::testing::Test {
 protected:
  void SetUp() override { write_all(folder_.path()); }
  void TearDown() override { std::filesystem::current_path(before_); }

  static void write(const std::filesystem::path& file, const std::string& text) {
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file) << text;
  }
  static void write_all(const std::filesystem::path& folder) {
    write(folder / "swing.xml", kSwing);
    write(folder / "swing.yaml", kRobot);
    write(folder / "part.obj", kMesh);
  }
  /// Opened by relative names, as people do.
  SceneOrigin relative_origin() const {
    std::filesystem::current_path(folder_.path());
    const SceneOrigin origin = *open_scene({"swing.xml", "swing.yaml", ""}, kAssets)->origin().scene;
    std::filesystem::current_path(before_);
    return origin;
  }
  static std::string complaint(const SceneOrigin& origin) {
    try {
      open_again(origin, kAssets);
    } catch (const SceneLost& error) {
      return error.what();
    }
    return "";
  }

  const testing::TemporaryFolder folder_;
  const std::filesystem::path before_ = std::filesystem::current_path();
};

TEST_F(SceneOriginTest, SaysWhatWasOpened) {
  const auto task =
      open_scene({folder_.path() / "swing.xml", (folder_.path() / "swing.yaml").string(), ""}, kAssets);
  const DemoOrigin origin = task->origin();
  EXPECT_EQ(origin.robot, "swing");
  EXPECT_EQ(origin.joints, 1);
  ASSERT_TRUE(origin.scene);
  EXPECT_EQ(origin.scene->scene, (folder_.path() / "swing.xml").string());
  EXPECT_EQ(origin.scene->folder, "") << "absolute names need none";
  const SceneOrigin relative = relative_origin();
  EXPECT_EQ(relative.scene, "swing.xml");
  EXPECT_EQ(relative.robot, "swing.yaml");
  EXPECT_EQ(std::filesystem::canonical(relative.folder), std::filesystem::canonical(folder_.path()));
  EXPECT_EQ(relative.scene_sha256, origin.scene->scene_sha256);
  EXPECT_EQ(relative.robot_sha256, origin.scene->robot_sha256);
}

TEST_F(SceneOriginTest, OpensFromAnywhereAndWhereItWasMovedTo) {
  const SceneOrigin origin = relative_origin();
  EXPECT_EQ(open_again(origin, kAssets)->name(), "swing");
  const testing::TemporaryFolder moved;
  write_all(moved.path());
  std::filesystem::remove(folder_.path() / "swing.xml");
  EXPECT_NE(complaint(origin).find("swing.xml, the scene that it was recorded in, is not there any more"),
            std::string::npos)
      << complaint(origin);
  std::filesystem::current_path(moved.path());
  EXPECT_EQ(open_again(origin, kAssets)->origin().scene->scene_sha256, origin.scene_sha256);
}

TEST_F(SceneOriginTest, WhatHasChangedIsNamed) {
  const SceneOrigin origin = relative_origin();
  write(folder_.path() / "part.obj", "v 0 0 0\nv 0.2" + kMesh.substr(kMesh.find(" 0 0\nv 0 0.1")));
  EXPECT_NE(complaint(origin).find("swing.xml, the scene that it was recorded in, has changed since"),
            std::string::npos)
      << "its mesh is another: " << complaint(origin);
  write(folder_.path() / "part.obj", kMesh);
  EXPECT_EQ(complaint(origin), "");
  write(folder_.path() / "swing.yaml", kRobot + "# and a remark\n");
  EXPECT_NE(complaint(origin).find("swing.yaml, the description of its robot, has changed since"),
            std::string::npos)
      << complaint(origin);
  write(folder_.path() / "swing.yaml", kRobot);
  write(folder_.path() / "swing.xml", "<mujoco><worldbody><geom type='ball'/></worldbody></mujoco>");
  EXPECT_NE(complaint(origin).find("cannot be opened any more"), std::string::npos) << complaint(origin);
}

}  // namespace
}  // namespace flowscope
