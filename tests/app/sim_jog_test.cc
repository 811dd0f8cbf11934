// Movements by hand on the sim thread: the dead man, undo, and what becomes a demonstration.
#include <gtest/gtest.h>

#include <functional>
#include <thread>

#include "app/jog_control.h"
#include "app/sim_loop.h"
#include "app/waypoint_overlay.h"

namespace flowscope {
namespace {

using namespace std::chrono_literals;

TEST(JogControl, ACommandEndsByItselfUnlessItIsRenewed) {
  JogControl control;
  JogCommand command;
  command.linear_m_s = {0.1, 0, 0};
  const auto start = JogControl::Clock::now();
  EXPECT_FALSE(control.wanted(start).moves());
  control.command(command, start);
  EXPECT_TRUE(control.wanted(start + 299ms).moves());
  EXPECT_FALSE(control.wanted(start + 300ms).moves());
  control.command(command, start + 250ms);
  EXPECT_TRUE(control.wanted(start + 500ms).moves());
  control.command({}, start + 300ms);
  EXPECT_FALSE(control.wanted(start + 310ms).moves()) << "a released key ends at once";
}

class SimJog : public ::testing::Test {
 protected:
  SimJog() : tasks(find_assets()), sim(tasks) { sim.reset("push_buttons", 0, 1).get(); }
  static bool wait_for(const std::function<bool()>& condition) {
    for (int i = 0; i < 2000; ++i) {
      if (condition()) return true;
      std::this_thread::sleep_for(5ms);
    }
    return false;
  }
  Eigen::Vector3d tool() const { return sim.snapshot().get()->robot.world_from_tool.position; }
  bool still() const { return sim.jog_report().state == JogState::still; }
  void nudge() {
    JogCommand command;
    command.linear_m_s = {0, 0.1, 0};
    sim.jog(command);
    ASSERT_TRUE(wait_for([&] { return sim.jog_report().state == JogState::moving; }));
    ASSERT_TRUE(wait_for([&] { return still(); })) << "a command that nobody renews ends";
  }

  TaskLibrary tasks;
  SimLoop sim;
};

TEST_F(SimJog, MovesUntilTheClientIsLostAndCanBeUndone) {
  const Eigen::Vector3d before = tool();
  nudge();
  const Eigen::Vector3d after = tool();
  EXPECT_GT(after.y(), before.y() + 0.003);
  EXPECT_LT(after.y(), before.y() + 0.1 * 2) << "it went on without its client";
  EXPECT_EQ(sim.snapshot().get()->by_hand.strokes, 1);
  EXPECT_TRUE(sim.snapshot().get()->by_hand.moved);
  EXPECT_TRUE(sim.undo_jog().get());
  EXPECT_LT((tool() - before).norm(), 1e-9);
  EXPECT_FALSE(sim.undo_jog().get());
}

TEST_F(SimJog, TheFingersAreAStrokeOfTheirOwn) {
  ASSERT_TRUE(sim.jog_gripper(0).get());
  EXPECT_LT(sim.snapshot().get()->robot.openness, 0.5);
  EXPECT_TRUE(sim.undo_jog().get());
  EXPECT_GT(sim.snapshot().get()->robot.openness, 0.9);
}

TEST_F(SimJog, AMarkBecomesAStepWhereTheToolIs) {
  nudge();
  const auto steps = sim.mark().get();
  ASSERT_EQ(steps.size(), 2u);
  EXPECT_EQ(sim.snapshot().get()->by_hand.marks, 1);
  EXPECT_EQ(sim.snapshot().get()->keyframe_history.size(), 2u);
  const Demo demo = sim.session_demo([](const SceneState&) { return Observation{}; }).get();
  EXPECT_EQ(demo.keyframes.size(), 1u);
  EXPECT_LT(
      position_error_m(demo.keyframes[0].action.world_from_tool, sim.snapshot().get()->robot.world_from_tool),
      1e-9);
}

TEST(WaypointOverlay, NumbersStepsAndShowsTheChosenOne) {
  PlacedStep first, close, second;
  first.step.what = MoveStep{};
  first.move = PlacedMove{{{0, 0, 1}, Eigen::Quaterniond::Identity()}, {}};
  close.step.what = GripperStep{0};
  close.openness = second.openness = 0;
  MoveStep straight;
  straight.linear = true;
  second.step.what = straight;
  second.move = PlacedMove{{{0, 0, 0.8}, Eigen::Quaterniond::Identity()}, {}};
  const Overlay overlay = overlay_of_waypoints({first, close, second}, 1);
  ASSERT_EQ(overlay.labels.size(), 2u);
  EXPECT_EQ(overlay.labels[1].text, "3") << "as the card's number";
  EXPECT_EQ(overlay.frames.size(), 2u);
  EXPECT_EQ(overlay.lines.size(), 1u);
  ASSERT_EQ(overlay.ghosts.size(), 1u);
  EXPECT_EQ(overlay.ghosts[0].openness, 0);
  EXPECT_EQ(overlay.ghosts[0].world_from_tool.position.z(), 1)
      << "the hand closes where the move before ended";
  EXPECT_TRUE(overlay_of_waypoints({first, close, second}, std::nullopt).ghosts.empty());
}

}  // namespace
}  // namespace flowscope
