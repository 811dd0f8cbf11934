// What falls off the table stays on the floor, and nothing else meets the floor.
#include "recorder/floor.h"

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>

#include "recorder/task.h"
#include "recorder/world.h"
#include "render/mujoco_owners.h"

namespace flowscope {
namespace {

constexpr double kPushed_m = 2.0;  ///< past the table's edge

/// Puts every loose body 2 m to the side of where it is, above nothing but the floor.
void push_off(World& world) {
  SceneState state = world.state();
  const mjModel* model = world.model();
  for (int i = 0; i < model->njnt; ++i) {
    if (model->jnt_type[i] == mjJNT_FREE)
      state.qpos[static_cast<std::size_t>(model->jnt_qposadr[i]) + 1] += kPushed_m;
  }
  world.restore(state);
}

bool is_there(const World& world) {
  return world.model()->geom_contype[mj_name2id(world.model(), mjOBJ_GEOM, "floor")] != 0;
}

class FloorOf : public ::testing::TestWithParam<std::string> {};

TEST_P(FloorOf, CatchesWhatFallsOffTheTable) {
  World world(TaskLibrary(FLOWSCOPE_SOURCE_DIR "/assets").get(GetParam()));
  const mjModel* model = world.model();
  const auto targets = world.joint_targets();
  world.advance(targets, 1);
  EXPECT_FALSE(is_there(world)) << "nothing is near it: it costs nothing";
  push_off(world);
  for (int i = 0; i < 60; ++i) world.advance(targets, 1);
  EXPECT_TRUE(is_there(world));
  for (int i = 0; i < model->njnt; ++i) {
    if (model->jnt_type[i] != mjJNT_FREE) continue;
    const mjtNum* at = world.data()->xpos + 3 * model->jnt_bodyid[i];
    EXPECT_GT(at[2], -0.05) << mj_id2name(model, mjOBJ_BODY, model->jnt_bodyid[i]);
    EXPECT_LT(at[2], 0.5) << "it has fallen";
    EXPECT_LT(std::hypot(at[0], at[1]), 6) << "and does not roll away";
  }
  const SceneState state = world.state();
  SceneState next[2];
  for (SceneState& one : next) {
    world.restore(state);
    world.advance(targets, 1);
    one = world.state();
  }
  EXPECT_EQ(next[0], next[1]);
}

INSTANTIATE_TEST_SUITE_P(Tasks, FloorOf,
                         ::testing::Values("stack_blocks", "stack_cups", "put_fruit_in_bowl",
                                           "place_wine_at_rack_location"));

TEST(FloorContacts, NoArmIsComparedWithIt) {
  World world(TaskLibrary(FLOWSCOPE_SOURCE_DIR "/assets").get("stack_blocks"));
  push_off(world);
  for (int i = 0; i < 10; ++i) world.advance(world.joint_targets(), 1);
  const mjModel* model = world.model();
  const int floor = mj_name2id(model, mjOBJ_GEOM, "floor");
  int meets = 0;
  for (int i = 0; i < model->ngeom; ++i) {
    if ((model->geom_contype[floor] & model->geom_conaffinity[i]) == 0) continue;
    ++meets;
    const int root = model->body_rootid[model->geom_bodyid[i]];
    EXPECT_EQ(model->jnt_type[model->body_jntadr[root]], mjJNT_FREE);
  }
  EXPECT_EQ(meets, 8) << "blocks";
}

ModelPtr compiled(const std::string& world) {
  mjVFS files;
  mj_defaultVFS(&files);
  const std::string text = "<mujoco><worldbody>" + world + "</worldbody></mujoco>";
  mj_makeEmptyFileVFS(&files, "a.xml", static_cast<int>(text.size()));
  std::copy(text.begin(), text.end(), static_cast<char*>(files.filedata[0]));
  char error[1000] = "";
  ModelPtr model(mj_loadXML("a.xml", &files, error, sizeof error));
  mj_deleteVFS(&files);
  EXPECT_TRUE(model) << error;
  return model;
}

TEST(FloorContacts, OtherPlanesStayAsTheyAre) {
  const std::string seen = "<geom name='plane' type='plane' size='1 1 1' contype='0' conaffinity='0' ";
  const std::string ball = "<body pos='0 0 0.2'><freejoint/><geom size='0.1'/></body>";
  const auto stops = [&](const std::string& text) {
    const ModelPtr model = compiled(text);
    const DataPtr data(mj_makeData(model.get()));
    mj_kinematics(model.get(), data.get());
    const Floor floor(model.get());
    floor.watch(model.get(), data.get());
    return model->geom_contype[mj_name2id(model.get(), mjOBJ_GEOM, "plane")] != 0;
  };
  EXPECT_TRUE(stops(seen + "/>" + ball));
  EXPECT_FALSE(stops(seen + "/>")) << "nothing is loose";
  EXPECT_FALSE(stops(seen + "pos='0 0 0.1'/><geom type='box' size='1 1 .01'/>" + ball)) << "water in a pool";
  EXPECT_FALSE(stops(seen + "euler='90 0 0'/>" + ball)) << "a wall";
}

}  // namespace
}  // namespace flowscope
