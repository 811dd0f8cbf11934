// Hands as public model collections have them pick a cube up and put it down.
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <fstream>

#include "recorder/gripper_shape.h"
#include "recorder/record.h"
#include "recorder/scene_task.h"
#include "recorder/world.h"
#include "tests/support/ghost_distance.h"
#include "tests/support/hand_models.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

constexpr const char* kPick =
    "steps:\n"
    "- move: {frame: cube, position: [0, 0, 0.10], rpy_deg: [180, 0, 0]}\n"
    "- move: {frame: cube, position: [0, 0, 0.005], rpy_deg: [180, 0, 0], path: linear}\n"
    "- gripper: close\n"
    "- move: {frame: world, position: [0.2, -0.1, 0.15], rpy_deg: [180, 0, 0]}\n"
    "- move: {frame: world, position: [0.2, -0.1, 0.028], rpy_deg: [180, 0, 0], path: linear, "
    "ignore_collisions: true}\n"
    "- gripper: open\n"
    "- move: {frame: world, position: [0.2, -0.1, 0.15], rpy_deg: [180, 0, 0], path: linear, "
    "ignore_collisions: "
    "true}\n";

struct Kind {
  const char* name;
  testing::HandModel (*hand)();
  double play_m;  ///< of its linkages
};
std::ostream& operator<<(std::ostream& out, const Kind& kind) { return out << kind.name; }

class HandOf : public ::testing::TestWithParam<Kind> {
 protected:
  std::shared_ptr<const Task> open() const {
    const testing::HandModel hand = GetParam().hand();
    std::ofstream(folder_.path() / "scene.xml") << testing::arm_scene(hand);
    std::ofstream(folder_.path() / "arm.yaml") << testing::arm_description(hand);
    return open_scene({folder_.path() / "scene.xml", (folder_.path() / "arm.yaml").string(), ""},
                      FLOWSCOPE_SOURCE_DIR "/assets");
  }
  testing::TemporaryFolder folder_;
};

TEST_P(HandOf, PicksACubeUpAndPutsItDown) {
  World world(open());
  EXPECT_TRUE(world.frame().gripper_open) << world.frame().openness;
  std::vector<double> inputs;
  const mjModel* model = world.model();
  const std::string servo = world.task().robot().fingers[0].actuator;
  const int actuator = mj_name2id(model, mjOBJ_ACTUATOR, servo.c_str());
  double highest = 0;
  const RunReport report = run_script(
      world, parse_script(kPick), [](const SceneState&) { return Observation{}; },
      [&](const Frame& frame) {
        inputs.push_back(frame.state.ctrl[static_cast<std::size_t>(actuator)]);
        highest = std::max(highest, world.world_from("cube").position.z());
      });
  ASSERT_TRUE(report.success) << report.reason;
  ASSERT_TRUE(report.demo);
  EXPECT_GT(highest, 0.1) << "the cube was carried";
  EXPECT_LT((world.world_from("cube").position - Eigen::Vector3d(0.2, -0.1, 0.02)).norm(), 0.01);
  EXPECT_TRUE(world.grasped().empty());

  const auto& frames = report.demo->frames;
  const auto bit = [&](std::size_t i) { return frames[i].gripper_open; };
  EXPECT_TRUE(bit(0));
  EXPECT_TRUE(frames.back().gripper_open);
  int changes = 0;
  for (std::size_t i = 1; i < frames.size(); ++i) changes += bit(i) != bit(i - 1);
  EXPECT_EQ(changes, 2) << "it closes once and opens once";
  const auto closed = std::ranges::count_if(frames, [](const Frame& frame) { return !frame.gripper_open; });
  EXPECT_GT(closed, 20);
  double narrowest = 1;
  for (const Frame& frame : frames) narrowest = std::min(narrowest, frame.openness);
  EXPECT_LT(narrowest, 0.6) << "the fingers came to the cube";
  EXPECT_GT(narrowest, 0.35) << "and not through it";
  // Every opening and closing is an action of its own, where the arm stood.
  int opening = 0;
  const auto& keyframes = report.demo->keyframes;
  for (std::size_t i = 1; i < keyframes.size(); ++i) {
    if (keyframes[i].action.openness == 1 && keyframes[i - 1].action.openness == 0) {
      ++opening;
      EXPECT_LT(keyframes[i].action.world_from_tool.position.z(), 0.04);
    }
  }
  EXPECT_EQ(opening, 1);
  const mjtNum* range = model->actuator_ctrlrange + 2 * actuator;
  EXPECT_GE(*std::ranges::min_element(inputs), range[0]);
  EXPECT_LE(*std::ranges::max_element(inputs), range[1]);
}

TEST_P(HandOf, SaysHowFarItIsOpen) {
  World world(open());
  const auto q = world.joint_targets();
  const auto ghost = gripper_shape(world.model(), world.task().robot());
  ASSERT_NE(ghost, nullptr);
  for (const double openness : {0.0, 0.5, 1.0}) {
    for (int i = 0; i < 40; ++i) world.advance(q, openness);
    EXPECT_NEAR(world.frame().openness, openness, 0.06);
    EXPECT_NEAR(world.openness_target(), openness, 1e-9);
    EXPECT_LT(testing::apart(world, *ghost), GetParam().play_m)
        << "the ghost's linkages are closed as well, " << openness;
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, HandOf,
                         ::testing::Values(Kind{"slides", testing::slide_hand, 0.004},
                                           Kind{"four_bars", testing::four_bar_hand, 0.004},
                                           Kind{"couplers", testing::coupler_hand, 0.012}),
                         [](const auto& kind) { return kind.param.name; });

}  // namespace
}  // namespace flowscope
