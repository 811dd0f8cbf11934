#include "recorder/world.h"

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <cmath>
#include <limits>

#include "recorder/task_placement.h"
#include "recorder/world_robot.h"
#include "render/mujoco_owners.h"

namespace flowscope {
namespace {

const TaskLibrary& library() {
  static const TaskLibrary tasks(FLOWSCOPE_SOURCE_DIR "/assets");
  return tasks;
}

const std::array<double, 7> home_joints = read_robot(FLOWSCOPE_SOURCE_DIR "/assets/robots/panda.yaml").home;

std::array<double, 7> moved(double by) {
  auto q = home_joints;
  for (std::size_t i = 0; i < 7; ++i) q[i] += i % 2 ? -by : by;
  return q;
}

double largest_error(const Frame& frame, const std::array<double, 7>& target) {
  double worst = 0;
  for (std::size_t i = 0; i < 7; ++i) worst = std::max(worst, std::abs(frame.q[i] - target[i]));
  return worst;
}

class EveryTask : public testing::TestWithParam<const char*> {
 protected:
  std::shared_ptr<const Task> task_ = library().get(GetParam());
};

TEST_P(EveryTask, PlacesItsWaypointsWithinBoundsAndLeavesSpace) {
  const ModelPtr model(mj_copyModel(nullptr, task_->model()));
  const DataPtr data(mj_makeData(model.get()));
  const WorldRobot robot(model.get(), task_->robot());
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const int variation = static_cast<int>(seed) % task_->variations();
    mj_resetData(model.get(), data.get());
    robot.go_home(data.get());
    const Episode episode = task_->reset(model.get(), data.get(), variation, seed);
    EXPECT_EQ(episode.seed, seed);
    EXPECT_EQ(episode.instructions, task_->instructions(variation));
    ASSERT_FALSE(episode.demonstration.steps.empty());
    mj_forward(model.get(), data.get());
    int waypoints = 0;
    for (const auto& step : episode.demonstration.steps) {
      const auto* move = std::get_if<MoveStep>(&step.what);
      if (!move) continue;
      const auto frame = find_frame(model.get(), data.get(), move->frame);
      ASSERT_TRUE(frame) << move->frame;
      EXPECT_TRUE(task_->bounds().contains(*frame * move->frame_from_tool.position)) << "seed " << seed;
      ++waypoints;
    }
    EXPECT_GE(waypoints, 2);
    // Nothing of the scene is pushed into anything else; a loose object may touch what it lies on.
    for (int i = 0; i < data->ncon; ++i) EXPECT_GT(data->contact[i].dist, -1e-4) << "seed " << seed;
    const std::vector<std::string> nothing;
    EXPECT_FALSE(task_->success(model.get(), data.get(), episode)->update(model.get(), data.get(), nothing));
  }
}

TEST_P(EveryTask, RestsAfterAReset) {
  World world(task_);
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    world.reset(static_cast<int>(seed) % task_->variations(), seed);
    EXPECT_FALSE(world.success());
    EXPECT_LT(largest_error(world.frame(), home_joints), 1e-4);
    EXPECT_EQ(world.frame().time_s, 0);
    const SceneState before = world.state();
    for (int i = 0; i < 10; ++i) world.advance(home_joints, 1);
    const SceneState after = world.state();
    for (std::size_t i = 0; i < before.qpos.size(); ++i)
      EXPECT_NEAR(before.qpos[i], after.qpos[i], 2e-4) << i;
    EXPECT_EQ(before.mocap_pos, after.mocap_pos);
    EXPECT_FALSE(world.success());
  }
}

TEST_P(EveryTask, IsTheSameTwiceBitForBit) {
  const auto run = [&](World& world) {
    world.reset(1, 42);
    for (int i = 1; i <= 20; ++i) world.advance(moved(0.02 * i), 1 - 0.04 * i);
    return world.state();
  };
  World first(task_), second(task_);
  second.reset(2, 7);
  second.advance(moved(0.1), 0);
  const SceneState expected = run(first);
  EXPECT_TRUE(run(second) == expected) << "whatever came before";
  EXPECT_TRUE(run(first) == expected);
  first.reset(1, 43);
  EXPECT_FALSE(first.state().mocap_pos == expected.mocap_pos) << "another seed, another placement";
}

TEST_P(EveryTask, GoesOnFromARestoredState) {
  World world(task_), other(task_);
  world.reset(0, 5);
  other.reset(2, 6);
  for (int i = 1; i <= 5; ++i) world.advance(moved(0.03 * i), 0.5);
  const SceneState middle = world.state();
  other.restore(middle);
  EXPECT_TRUE(other.state() == middle);
  EXPECT_EQ(other.robot().world_from_tool, world.robot().world_from_tool);
  for (int i = 6; i <= 10; ++i) {
    world.advance(moved(0.03 * i), 0.5);
    other.advance(moved(0.03 * i), 0.5);
  }
  EXPECT_TRUE(other.state() == world.state());
}

INSTANTIATE_TEST_SUITE_P(Tasks, EveryTask,
                         testing::Values("push_buttons", "open_drawer", "insert_onto_square_peg"));

TEST(World, FollowsTheJointTargets) {
  World world(library().get("push_buttons"));
  Frame frame;
  for (int i = 1; i <= 40; ++i) {
    const double s = std::min(1.0, i / 30.0);
    frame = world.advance(moved(0.6 * s * s * s * (10 - 15 * s + 6 * s * s)), 1);
    EXPECT_LT(largest_error(frame, moved(0.6 * s * s * s * (10 - 15 * s + 6 * s * s))), 0.005);
  }
  EXPECT_LT(largest_error(frame, moved(0.6)), 1e-4);
  EXPECT_NEAR(frame.time_s, 2.0, 1e-9);
  for (const double speed : frame.dq) EXPECT_LT(std::abs(speed), 1e-3);
}

TEST(World, KnowsItsFramesByName) {
  World world(library().get("push_buttons"));
  EXPECT_EQ(world.world_from("world"), Pose{});
  const Pose tool = world.world_from("tool");
  // The published dimensions at the benchmark's home posture, base at (-0.268, 0, 0.750) m.
  EXPECT_LT((tool.position - Eigen::Vector3d(0.28261, 0, 1.45140)).norm(), 2e-5);
  EXPECT_LT((tool.rotation * Eigen::Vector3d::UnitZ() - Eigen::Vector3d(0.17362, 0, -0.98481)).norm(), 1e-4);
  EXPECT_NEAR(world.world_from("button_1").position.z(), 0.752, 1e-12);
  try {
    world.world_from("lever");
    FAIL() << "an unknown frame was accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("button_2_cap"), std::string::npos);
  }
}

TEST(World, RefusesWhatItCanNotDo) {
  World world(library().get("open_drawer"));
  EXPECT_THROW(world.reset(3, 0), std::invalid_argument);
  EXPECT_THROW(world.reset(-1, 0), std::invalid_argument);
  auto target = home_joints;
  target[3] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(world.advance(target, 1), std::invalid_argument);
  EXPECT_THROW(world.advance(home_joints, 1.5), std::invalid_argument);
  SceneState state = world.state();
  state.qpos.pop_back();
  EXPECT_THROW(world.restore(state), std::invalid_argument);
  World other(library().get("push_buttons"));
  EXPECT_THROW(other.restore(world.state()), std::invalid_argument);
}

TEST(World, ABrokenSimulationIsSaidAndRebuilt) {
  World world(library().get("insert_onto_square_peg"));
  world.reset(0, 3);
  const SceneState good = world.state();
  SceneState bad = good;
  bad.qvel[bad.qvel.size() - 3] = std::numeric_limits<double>::quiet_NaN();
  world.restore(bad);
  EXPECT_THROW(world.advance(home_joints, 1), SimulationFailed);
  EXPECT_TRUE(world.state() == good) << "the same episode from its beginning";
  EXPECT_NO_THROW(world.advance(home_joints, 1));
}

TEST(World, PressedButtonsLatchInOrderAndTurnGreen) {
  World world(library().get("push_buttons"));
  world.reset(2, 11);  // three buttons
  const mjModel* model = world.model();
  const auto press = [&](const char* joint, double depth) {
    SceneState state = world.state();
    state.qpos[static_cast<std::size_t>(model->jnt_qposadr[mj_name2id(model, mjOBJ_JOINT, joint)])] -= depth;
    return state;
  };
  ASSERT_EQ(world.terms().size(), 3u);
  world.restore(press("button_2_slide", 0.005));
  EXPECT_FALSE(world.terms().at(0).met || world.terms().at(1).met) << "the second alone does not count";
  world.reset(2, 11);
  world.restore(press("button_1_slide", 0.005));
  EXPECT_TRUE(world.terms().at(0).met);
  EXPECT_FALSE(world.success());
  const int material = mj_name2id(model, mjOBJ_MATERIAL, "button_1_cap");
  const float* rgba = world.model()->mat_rgba + 4 * material;
  EXPECT_EQ(rgba[0], 0);
  EXPECT_EQ(rgba[1], 0.5f);
  for (int i = 0; i < 10; ++i) world.advance(home_joints, 1);
  const auto address =
      static_cast<std::size_t>(model->jnt_qposadr[mj_name2id(model, mjOBJ_JOINT, "button_1_slide")]);
  EXPECT_NEAR(world.state().qpos[address], 0.003, 1e-3) << "the cap springs back";
  EXPECT_TRUE(world.terms().at(0).met) << "and stays pressed for the task";
}

TEST(World, AnOpenDrawerStaysOpenAndCounts) {
  World world(library().get("open_drawer"));
  world.reset(1, 4);
  const mjModel* model = world.model();
  const auto address =
      static_cast<std::size_t>(model->jnt_qposadr[mj_name2id(model, mjOBJ_JOINT, "drawer_middle_slide")]);
  SceneState state = world.state();
  state.qpos[address] = 0.149;
  world.restore(state);
  EXPECT_FALSE(world.success());
  state.qpos[address] = 0.151;
  world.restore(state);
  EXPECT_TRUE(world.success());
  for (int i = 0; i < 20; ++i) world.advance(home_joints, 1);
  EXPECT_NEAR(world.state().qpos[address], 0.151, 1e-4);
}

/// The ring moved between the fingers of the arm at home.
SceneState ring_in_hand(const World& world) {
  const mjModel* model = world.model();
  SceneState state = world.state();
  const int joint = model->body_jntadr[mj_name2id(model, mjOBJ_BODY, "ring")];
  const auto address = static_cast<std::size_t>(model->jnt_qposadr[joint]);
  const Pose tool = world.world_from("tool");
  for (int i = 0; i < 3; ++i) state.qpos[address + static_cast<std::size_t>(i)] = tool.position[i];
  for (int i = 0; i < 4; ++i) state.qpos[address + 3 + static_cast<std::size_t>(i)] = tool.wxyz()[i];
  return state;
}

TEST(World, WhatIsGraspedMovesAlongUntilReleased) {
  World world(library().get("insert_onto_square_peg"));
  world.reset(0, 9);
  world.grasp();
  EXPECT_TRUE(world.grasped().empty()) << "the ring lies on the table";
  world.restore(ring_in_hand(world));
  world.grasp();
  ASSERT_EQ(world.grasped(), std::vector<std::string>{"ring"});
  const Pose before = world.world_from("tool").inverse() * world.world_from("ring");
  for (int i = 1; i <= 30; ++i) world.advance(moved(0.01 * i), 0);
  for (int i = 0; i < 10; ++i) world.advance(moved(0.3), 0);
  const Pose after = world.world_from("tool").inverse() * world.world_from("ring");
  EXPECT_LT(position_error_m(before, after), 0.001);
  EXPECT_LT(rotation_error_rad(before, after), 0.02);
  world.release();
  EXPECT_TRUE(world.grasped().empty());
  const double height = world.world_from("ring").position.z();
  for (int i = 0; i < 10; ++i) world.advance(moved(0.3), 1);
  EXPECT_LT(world.world_from("ring").position.z(), height - 0.05) << "it falls";
}

TEST(World, ARingOverThePegIsSuccess) {
  World world(library().get("insert_onto_square_peg"));
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    world.reset(3, seed);
    std::string peg;
    for (const auto& step : world.episode().demonstration.steps) {
      const auto* move = std::get_if<MoveStep>(&step.what);
      if (move && move->frame != "ring") peg = move->frame;
    }
    const mjModel* model = world.model();
    const int joint = model->body_jntadr[mj_name2id(model, mjOBJ_BODY, "ring")];
    const auto address = static_cast<std::size_t>(model->jnt_qposadr[joint]);
    const auto put = [&](const std::string& where, double height) {
      SceneState state = world.state();
      const Pose at = world.world_from(where) * Pose{{0, 0, height}, Eigen::Quaterniond::Identity()};
      for (int i = 0; i < 3; ++i) state.qpos[address + static_cast<std::size_t>(i)] = at.position[i];
      for (int i = 0; i < 4; ++i) state.qpos[address + 3 + static_cast<std::size_t>(i)] = at.wxyz()[i];
      world.restore(state);
    };
    for (const std::string other : {"peg_1", "peg_2", "peg_3"}) {
      put(other, 0.0252);
      EXPECT_EQ(world.success(), other == peg) << other;
    }
    put(peg, 0.12);
    EXPECT_FALSE(world.success()) << "still at the top";
    for (int i = 0; i < 10 && !world.success(); ++i) world.advance(home_joints, 1);
    EXPECT_TRUE(world.success()) << "slid down";
  }
}

}  // namespace
}  // namespace flowscope
