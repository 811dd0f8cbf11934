#include "recorder/teleop.h"

#include <gtest/gtest.h>

#include "recorder/keyframes.h"
#include "recorder/motion/kinematics.h"
#include "recorder/motion/motion.h"
#include "recorder/teleop_session.h"

namespace flowscope {
namespace {

class Teleop : public ::testing::Test {
 protected:
  Teleop() : world(library().get("push_buttons")) {
    world.reset(0, 1);
    session.restart(world);
  }
  static const TaskLibrary& library() {
    static const TaskLibrary tasks(find_assets());
    return tasks;
  }
  JogStep step(Jogger& jogger, const JogCommand& command) {
    JogStep result = jogger.step(command);
    if (result.frame) session.keep_by_hand(*result.frame, now_s += 0.05);
    return result;
  }
  /// Holds a key for `frames`, then lets go and waits until the arm rests. The last answer while it was held.
  JogStep hold(const JogCommand& command, int frames) {
    Jogger jogger(world);
    session.begin_stroke(now_s);
    JogStep last;
    for (int i = 0; i < frames; ++i) last = step(jogger, command);
    for (int i = 0; i < 40 && !jogger.at_rest(); ++i) step(jogger, {});
    EXPECT_TRUE(jogger.at_rest());
    return last;
  }
  static JogCommand along(const Eigen::Vector3d& linear_m_s) {
    JogCommand command;
    command.linear_m_s = linear_m_s;
    return command;
  }
  Pose tool() const { return world.robot().world_from_tool; }
  /// Brings the tool above a button by a planned move, fingers shut.
  void go_above(const std::string& button, double height_m) {
    MoveRequest request;
    request.world_from_tool =
        world.world_from(button) * Pose{{0, 0, height_m}, Eigen::Quaterniond(0, 1, 0, 0)};
    request.time_limit_s = 30;
    const FrameSink keep = [this](const Frame& frame) { return session.keep(frame), true; };
    ASSERT_TRUE(move_to(world, request, keep));
    ASSERT_TRUE(move_gripper(world, 0.1, keep));
  }

  /// Moves the fingers by hand.
  void fingers(double openness) {
    session.begin_stroke(now_s);
    ASSERT_TRUE(move_gripper(world, openness, [this](const Frame& frame) {
      session.keep_by_hand(frame, now_s += 0.05);
      return true;
    }));
  }
  int last() const { return session.frames() - 1; }

  World world;
  TeleopSession session;
  double now_s = 100;  ///< a clock that goes on between movements, too
};

TEST_F(Teleop, MovesAlongTheWorldsAxesAndTurnsNothing) {
  const Pose before = tool();
  hold(along({0, 0.1, 0}), 20);
  const Eigen::Vector3d moved = tool().position - before.position;
  EXPECT_GT(moved.y(), 0.08);
  EXPECT_LT(moved.y(), 0.105);
  EXPECT_LT(std::hypot(moved.x(), moved.z()), 0.001);
  EXPECT_LT(rotation_error_rad(tool(), before), 0.005);
}

TEST_F(Teleop, MovesAndTurnsAlongTheToolsAxes) {
  const Pose before = tool();
  JogCommand in = along({0, 0, 0.1});
  in.in_tool_frame = true;
  hold(in, 20);
  const Eigen::Vector3d moved = before.rotation.inverse() * (tool().position - before.position);
  EXPECT_GT(moved.z(), 0.08);
  EXPECT_LT(moved.head<2>().norm(), 0.001);

  const Pose straight = tool();
  JogCommand turn;
  turn.angular_rad_s = {0, 0, 0.5};
  turn.in_tool_frame = true;
  hold(turn, 20);
  EXPECT_LT(position_error_m(tool(), straight), 0.001) << "turns about the tool's own point";
  const Eigen::AngleAxisd turned(straight.rotation.inverse() * tool().rotation);
  EXPECT_NEAR(turned.angle(), 0.47, 0.06);
  EXPECT_GT(std::abs(turned.axis().z()), 0.999);
}

TEST_F(Teleop, StopsAtRestWhenTheKeyIsLetGo) {
  hold(along({0.1, 0, 0}), 10);
  for (const double dq : world.frame().dq) EXPECT_LE(std::abs(dq), 0.1);
  const Pose rest = tool();
  Jogger jogger(world);
  EXPECT_FALSE(jogger.step({}).frame) << "nothing is simulated while nobody asks";
  EXPECT_EQ(tool(), rest);
}

TEST_F(Teleop, StopsAtWhatIsInTheWayAndSaysWhatItIs) {
  go_above("button_1", 0.06);
  const JogStep last = hold(along({0, 0, -0.1}), 40);
  EXPECT_EQ(last.state, JogState::blocked);
  EXPECT_NE(last.message.find("button_1_cap"), std::string::npos) << last.message;
  EXPECT_FALSE(world.success());
  const double blocked_at = tool().position.z();
  const JogStep away = hold(along({0, 0, 0.1}), 20);
  EXPECT_EQ(away.state, JogState::moving) << away.message;
  EXPECT_GT(tool().position.z(), blocked_at + 0.05);
}

TEST_F(Teleop, PushesWhenItMay) {
  go_above("button_1", 0.06);
  JogCommand down = along({0, 0, -0.1});
  down.may_touch = true;
  hold(down, 15);
  EXPECT_TRUE(world.success());
}

TEST_F(Teleop, IsHeldBackByWhatDoesNotYield) {
  go_above("button_1", 0.06);
  JogCommand down = along({0, 0, -0.1});
  down.may_touch = true;
  const JogStep last = hold(down, 60);
  EXPECT_EQ(last.state, JogState::blocked);
  EXPECT_NE(last.message.find("holds the tool back"), std::string::npos) << last.message;
}

TEST_F(Teleop, SaysWhenTheArmEnds) {
  const JogStep last = hold(along({0.25, 0, 0.25}), 100);
  EXPECT_EQ(last.state, JogState::unreachable);
  EXPECT_FALSE(last.message.empty());
  const Kinematics kinematics = Kinematics::from_model(world.model(), world.task().robot());
  EXPECT_TRUE(kinematics.limits().contain(world.frame().q));
  const JogStep back = hold(along({-0.25, 0, -0.25}), 20);
  EXPECT_EQ(back.state, JogState::moving) << back.message;
}

TEST_F(Teleop, UndoGoesBackToBeforeTheStroke) {
  hold(along({0, 0.1, 0}), 10);
  const SceneState between = world.state();
  const int frames = session.frames();
  hold(along({0.1, 0, 0}), 10);
  EXPECT_TRUE(session.mark());
  ASSERT_TRUE(session.undo(world));
  EXPECT_EQ(world.state().qpos, between.qpos);
  EXPECT_EQ(world.state().time_s, between.time_s);
  EXPECT_EQ(session.frames(), frames);
  EXPECT_EQ(session.marks(), 0);
  ASSERT_TRUE(session.undo(world));
  EXPECT_EQ(session.frames(), 1);
  EXPECT_FALSE(session.undo(world)) << "nothing is left";
}

TEST_F(Teleop, UndoKeepsWhatOrderedTermsHaveLatched) {
  int two = 0;  // the first variation with two buttons in order
  const auto thens = [](const std::string& text) {
    const auto first = text.find("then");
    return first != std::string::npos && text.find("then", first + 1) == std::string::npos;
  };
  while (!thens(world.task().instructions(two).front())) ++two;
  world.reset(two, 1);
  session.restart(world);
  go_above("button_1", 0.06);
  JogCommand down = along({0, 0, -0.1});
  down.may_touch = true;
  hold(down, 15);
  hold(along({0, 0, 0.1}), 15);
  ASSERT_FALSE(world.success());
  ASSERT_TRUE(world.terms()[0].met);
  hold(along({0, 0, 0.1}), 5);
  ASSERT_TRUE(session.undo(world));
  EXPECT_TRUE(world.terms()[0].met) << "the first button stays pressed";
  ASSERT_TRUE(session.undo(world));
  ASSERT_TRUE(session.undo(world));
  EXPECT_FALSE(world.terms()[0].met) << "and is not before it was pressed";
}

TEST_F(Teleop, ASessionBecomesADemonstration) {
  EXPECT_THROW(session.demo(world, [](const SceneState&) { return Observation{}; }), std::logic_error);
  hold(along({0, 0.1, 0}), 10);
  ASSERT_TRUE(session.mark());
  EXPECT_FALSE(session.mark()) << "one moment is one keyframe";
  const int marked = session.frames() - 1;
  hold(along({0.1, 0, 0}), 10);
  const Demo demo = session.demo(world, [](const SceneState&) { return Observation{}; });
  EXPECT_EQ(demo.info.task, "push_buttons");
  EXPECT_EQ(static_cast<int>(demo.frames.size()), session.frames());
  ASSERT_EQ(demo.keyframes.size(), 2u);
  EXPECT_EQ(demo.keyframes[0].frame, marked);
  EXPECT_EQ(demo.keyframes[1].frame, session.frames() - 1);
}

TEST_F(Teleop, ShortPausesAreNoKeyframesAndLongOnesAre) {
  hold(along({0, 0.04, 0}), 40);  // so slowly that the arm counts as still all the way
  now_s += 0.4;
  hold(along({0, 0.1, 0}), 10);
  now_s += 0.9;
  hold(along({0, 0, -0.1}), 10);
  const int rest = last();
  now_s += 1.5;
  hold(along({0.1, 0, 0}), 10);
  EXPECT_EQ(session.keyframes(), (std::vector<int>{rest, last()}));
  const Demo demo = session.demo(world, [](const SceneState&) { return Observation{}; });
  EXPECT_GT(find_keyframes(demo.frames).size(), 8u) << "what the benchmark's rule makes of it";
  EXPECT_EQ(demo.keyframes.size(), 2u);
}

TEST_F(Teleop, TheFingersChangeIsOneKeyframeWithTheRestsAroundIt) {
  hold(along({0, 0.1, 0}), 10);
  now_s += 2;  // over the thing, thinking
  fingers(0);
  const int closed = last();
  now_s += 2;
  hold(along({0, 0, 0.1}), 10);
  EXPECT_EQ(session.keyframes(), (std::vector<int>{closed, last()}));
  fingers(1);
  EXPECT_EQ(session.keyframes(), (std::vector<int>{closed, last()})) << "let go of where the movement ended";
}

TEST_F(Teleop, ClosingAndOpeningAtOnePlaceAreTwoKeyframes) {
  hold(along({0, 0.1, 0}), 10);
  fingers(0);
  fingers(1);
  const std::vector<int> keyframes = session.keyframes();
  ASSERT_EQ(keyframes.size(), 2u);
  EXPECT_EQ(keyframes.back(), last());
}

TEST_F(Teleop, TouchingUpAPlaceIsOneKeyframe) {
  hold(along({0, 0.1, 0}), 10);
  now_s += 2;
  hold(along({0, 0.02, 0}), 4);  // less than 5 mm
  const int fine = last();
  now_s += 2;
  hold(along({0, 0, 0.1}), 10);
  EXPECT_EQ(session.keyframes(), (std::vector<int>{fine, last()}));
}

TEST_F(Teleop, WhatScriptsDidBetweenKeepsTheBenchmarksRule) {
  hold(along({0, 0.1, 0}), 10);
  const int handed_over = last();
  go_above("button_1", 0.06);
  const int above = last();
  hold(along({0, 0, -0.02}), 20);
  const std::vector<int> keyframes = session.keyframes();
  ASSERT_GE(keyframes.size(), 3u);
  EXPECT_EQ(keyframes.front(), handed_over);
  EXPECT_EQ(keyframes.back(), last());
  int scripted = 0;
  for (const int k : keyframes) scripted += k > handed_over && k <= above;
  EXPECT_GE(scripted, 1) << "the end of the planned move, the fingers";
  EXPECT_EQ(static_cast<int>(keyframes.size()), scripted + 2) << "and none while the hand crept";
}

TEST_F(Teleop, ARestThatIsTakenBackIsNone) {
  hold(along({0, 0.1, 0}), 10);
  const int first = last();
  now_s += 2;
  hold(along({0.1, 0, 0}), 10);
  now_s += 2;
  hold(along({0, 0, -0.1}), 10);
  ASSERT_EQ(session.keyframes().size(), 3u);
  ASSERT_TRUE(session.undo(world));
  ASSERT_TRUE(session.undo(world));
  now_s += 0.2;
  hold(along({0, 0.1, 0}), 10);
  EXPECT_EQ(session.keyframes(), (std::vector<int>{first, last()})) << "the first rest was one";
}

}  // namespace
}  // namespace flowscope
