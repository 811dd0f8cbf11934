// Whatever is wrong with a scene is told at the file and line where its author wrote it.
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <fstream>

#include "recorder/scene_files.h"
#include "recorder/scene_task.h"
#include "recorder/task_folder.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

const std::filesystem::path kAssets = FLOWSCOPE_SOURCE_DIR "/assets";
const std::string kTetrahedron =
    "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";

class ScenePlaces : public ::testing::Test {
 protected:
  std::string file(const std::string& name, const std::string& text) const {
    const auto path = folder_.path() / name;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path) << text;
    return path.string();
  }
  std::string at(const std::string& name) const { return (folder_.path() / name).string(); }
  static std::string complaint(const SceneCall& call) {
    try {
      open_scene(call, kAssets);
    } catch (const BadScript& error) {
      return error.what();
    }
    return "";
  }
  /// Of a scene that includes `part` in its line 3.
  std::string with_part(const std::string& part) const {
    file("parts/part.xml", part);
    return complaint({file("scene.xml",
                           "<mujoco>\n  <!-- a\n  --><include file='parts/part.xml'/>\n"
                           "<worldbody><geom size='1'/></worldbody></mujoco>"),
                      "", ""});
  }
  testing::TemporaryFolder folder_;
};

#define EXPECT_BEGINS(text, start) EXPECT_EQ((text).rfind((start), 0), 0u) << (text)
#define EXPECT_HAS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

TEST_F(ScenePlaces, OfIncludedFilesAreTheirOwn) {
  const std::string part = at("parts/part.xml");
  const std::pair<const char*, const char*> wrong[] = {
      {"<worldbody>\n\n<geom type='ball'/></worldbody>", "invalid keyword: 'ball' in <geom>"},
      {"<worldbody>\n\n<geom typ='box'/></worldbody>", "unrecognized attribute: 'typ' in <geom>"},
      {"<worldbody>\n<body>\n<joint axis='0 0 0'/></body></worldbody>", "axis too small"},
      {"<asset>\n\n<material name='a' texture='none'/></asset>", "none"},
      {"<actuator>\n\n<motor name='m' joint='none'/></actuator>", "unknown transmission target 'none'"},
      {"<keyframe>\n\n<key qpos='1 2'/></keyframe>", "invalid qpos size"},
      {"<worldbody>\n\n<geom></body></worldbody>", "is no valid XML"},
      {"\n\n<include file='none.xml'/>", "none.xml, is not there"},
      {"\n\n<include file='scene.xml'/>", "a second time"}};
  for (const auto& [text, what] : wrong) {
    const std::string said = with_part("<mujocoinclude>" + std::string(text) + "</mujocoinclude>");
    EXPECT_BEGINS(said, part + ":3: ");
    EXPECT_HAS(said, what);
  }
  EXPECT_BEGINS(with_part("<mujocoinclude/>"), at("scene.xml") + ":3: ");
  EXPECT_BEGINS(with_part(""), part + ":1: ");
  EXPECT_EQ(with_part("<mujocoinclude><worldbody><geom size='1'/></worldbody></mujocoinclude>"), "");
}

TEST_F(ScenePlaces, OfFilesIncludedByIncludedOnesToo) {
  file("deep/er.xml", "<mujoco>\n<worldbody>\n<site typ='box'/></worldbody></mujoco>");
  EXPECT_BEGINS(with_part("<mujoco>\n<include file='deep/er.xml'/></mujoco>"), at("deep/er.xml") + ":3: ");
}

TEST_F(ScenePlaces, OfATasksSceneToo) {
  file("pour/task.yaml", "bounds: {min: [0, 0, 0], max: [1, 1, 1]}\n");
  file("pour/scene.xml",
       "<mujoco><include file='../../scenes/table.xml'/><include file='panda.xml'/>\n"
       "<include file='mug.xml'/></mujoco>");
  file("pour/mug.xml", "<mujocoinclude><worldbody>\n<geom type='cup'/></worldbody></mujocoinclude>");
  try {
    load_task(at("pour"), kAssets);
    ADD_FAILURE();
  } catch (const BadScript& error) {
    EXPECT_BEGINS(std::string(error.what()), at("pour/mug.xml") + ":2: invalid keyword: 'cup'");
  }
}

TEST_F(ScenePlaces, AllMissingFilesAreNamed) {
  file("there.obj", kTetrahedron);
  const std::string said = with_part(
      "<mujocoinclude><asset><mesh file='there.obj'/>\n<mesh name='a' file='gone.stl'/>\n"
      "<texture name='t' type='2d' file='gone.png'/></asset></mujocoinclude>");
  EXPECT_EQ(said, at("parts/part.xml") + ":2: the mesh's file " + at("gone.stl") + " is not there\n" +
                      at("parts/part.xml") + ":3: the texture's file " + at("gone.png") + " is not there");
}

TEST_F(ScenePlaces, AMeshThatMujocoDoesNotReadIsToldSo) {
  file("mug.dae", "<COLLADA/>");
  const std::string said =
      with_part("<mujocoinclude><asset>\n<mesh file='mug.dae'/></asset></mujocoinclude>");
  EXPECT_BEGINS(said, at("parts/part.xml") + ":2: ");
  EXPECT_HAS(said, "scene import");
}

TEST_F(ScenePlaces, AScenesOwnFilesComeBeforeOursOfTheSameName) {
  file("panda.xml", "<mujoco><worldbody><geom name='mine' size='1'/></worldbody></mujoco>");
  const auto whole = file("whole.xml", "<mujoco><include file='panda.xml'/></mujoco>");
  for (const std::string& scene : {whole, at("panda.xml")}) {
    const auto task = open_scene({scene, "", ""}, kAssets);
    EXPECT_EQ(task->model()->ngeom, 1) << scene;
    EXPECT_GE(mj_name2id(task->model(), mjOBJ_GEOM, "mine"), 0) << scene;
  }
}

TEST_F(ScenePlaces, WhatWouldOpenEmptySaysWhy) {
  const std::string robot =
      "<robot name='a'><link name='l'><visual><geometry><box size='1 1 1'/></geometry>"
      "</visual></link></robot>";
  for (const char* name : {"two.xml", "two.urdf"}) {
    const std::string said = complaint({file(name, "<mujoco><compiler/></mujoco>\n" + robot), "", ""});
    EXPECT_BEGINS(said, at(name) + ":2: <robot> stands after <mujoco>");
    EXPECT_HAS(said, "belongs inside <robot>");
  }
  EXPECT_BEGINS(complaint({file("b.urdf", robot + "\n<mujoco/>"), "", ""}), at("b.urdf") + ":2: <mujoco> ");
  EXPECT_HAS(complaint({file("c.xml", "<mujoco><worldbody/></mujoco>"), "", ""}), "it has no <geom>");
  EXPECT_HAS(complaint({file("d.urdf", "<robot name='a'><link name='l'/></robot>"), "", ""}), "<visual>");
  EXPECT_HAS(
      complaint(
          {file("h.xml", "<mujoco><option timestep='-1'/><worldbody><geom size='1'/></worldbody></mujoco>"),
           "", ""}),
      "timestep");
  EXPECT_BEGINS(complaint({file("g.sdf", "\n<sdf version='1.6'/>"), "", ""}),
                at("g.sdf") + ":2: its first element is <sdf>");
  std::string drops = robot;
  drops.insert(drops.find("<link"), "<mujoco><compiler/></mujoco>");
  EXPECT_HAS(complaint({file("e.urdf", drops), "", ""}), "discardvisual");
  std::string said;
  SceneCall hidden{file("f.xml", "<mujoco><worldbody><geom size='1' group='4'/></worldbody></mujoco>"), "",
                   ""};
  hidden.note = [&](const std::string& text) { said = text; };
  open_scene(hidden, kAssets);
  EXPECT_HAS(said, "nothing in it can be seen");
}

}  // namespace
}  // namespace flowscope
