#include "recorder/record.h"

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include "recorder/lost_things.h"
#include "recorder/script_check.h"

namespace flowscope {
namespace {

std::shared_ptr<const Task> task(const std::string& name) {
  static const TaskLibrary library(find_assets());
  return library.get(name);
}

Observation black(const SceneState& state) {
  Observation observation;
  for (const auto& name : observation_cameras(task(state.scene)->model())) {
    View view;
    view.camera.name = name;
    view.camera.far_m = state.time_s;  // tells which moment was photographed
    view.rgb = ImageRgb(observation_size, observation_size);
    view.depth = DepthImage(observation_size, observation_size);
    observation.views.push_back(view);
  }
  return observation;
}

RunReport run_text(World& world, const std::string& text) {
  return run_script(world, parse_script(text, "user.yaml"), black);
}

class Demonstrations : public ::testing::TestWithParam<std::pair<std::string, int>> {};

TEST_P(Demonstrations, SucceedWithOneKeyframePerWaypoint) {
  const auto& [name, most_keyframes] = GetParam();
  World world(task(name));
  for (int seed = 0; seed < 3; ++seed) {
    const int variation = seed % world.task().variations();
    world.reset(variation, static_cast<std::uint64_t>(seed));
    int seen = 0;
    const RunReport report =
        run_script(world, world.episode().demonstration, black, [&](const Frame&) { ++seen; });
    ASSERT_TRUE(report.success) << name << " seed " << seed << ": " << report.reason;
    EXPECT_TRUE(report.reason.empty());
    const Demo& demo = *report.demo;
    EXPECT_EQ(demo.info.task, name);
    EXPECT_EQ(demo.info.variation, variation);
    EXPECT_EQ(demo.info.seed, static_cast<std::uint64_t>(seed));
    EXPECT_EQ(demo.info.instruction, world.task().instructions(variation).front());
    EXPECT_EQ(demo.info.created.size(), 20u);
    EXPECT_EQ(static_cast<int>(demo.frames.size()), demo.info.frames);
    EXPECT_EQ(seen, demo.info.frames);
    EXPECT_NEAR(report.sim_seconds, 0.05 * (demo.info.frames - 1), 1e-6);
    EXPECT_EQ(static_cast<int>(demo.keyframes.size()), demo.info.keyframes);
    const int steps_that_move = name == "push_buttons" ? 2 * (1 + variation % 3) : most_keyframes;
    EXPECT_EQ(demo.info.keyframes, steps_that_move) << name << " seed " << seed;
    EXPECT_EQ(demo.start, black(demo.frames.front().state));
    int before = 0;
    for (const auto& keyframe : demo.keyframes) {
      EXPECT_GT(keyframe.frame, before);
      before = keyframe.frame;
      const Frame& frame = demo.frames[keyframe.frame];
      EXPECT_EQ(keyframe.action.world_from_tool, frame.world_from_tool);
      EXPECT_EQ(keyframe.action.open(), frame.gripper_open);
      EXPECT_EQ(keyframe.observation, black(frame.state));
      EXPECT_TRUE(demo.bounds.contains(frame.world_from_tool.position))
          << frame.world_from_tool.position.transpose();
    }
    EXPECT_EQ(before, demo.info.frames - 1);
  }
}

INSTANTIATE_TEST_SUITE_P(AllTasks, Demonstrations,
                         ::testing::Values(std::pair{"push_buttons", 6}, std::pair{"open_drawer", 3},
                                           std::pair{"insert_onto_square_peg", 5}),
                         [](const auto& test) { return test.param.first; });

TEST(Record, SameSeedSameDemonstrationBitForBit) {
  for (const std::string name : {"open_drawer", "insert_onto_square_peg"}) {
    std::vector<std::vector<Frame>> runs;
    for (int run = 0; run < 2; ++run) {
      World world(task(name));
      if (run == 1) {  // what went before must not matter
        world.reset(0, 99);
        run_script(world, world.episode().demonstration, {});
      }
      world.reset(1, 5);
      const RunReport report = run_script(world, world.episode().demonstration, black);
      ASSERT_TRUE(report.success) << report.reason;
      runs.push_back(report.demo->frames);
    }
    ASSERT_EQ(runs[0].size(), runs[1].size());
    for (std::size_t i = 0; i < runs[0].size(); ++i) EXPECT_TRUE(runs[0][i].state == runs[1][i].state) << i;
  }
}

TEST(Record, UnreachablePoseNamesWaypointAndLine) {
  World world(task("push_buttons"));
  world.reset(0, 1);
  const RunReport report = run_text(world, R"(steps:
  - gripper: 0.1
  - move: {position: [2, 0, 1], rpy_deg: [180, 0, 0]}
)");
  EXPECT_FALSE(report.success);
  EXPECT_FALSE(report.demo.has_value());
  EXPECT_EQ(report.step, 1);
  EXPECT_EQ(report.line, 3);
  EXPECT_EQ(report.reason.find("waypoint 2 (line 3): unreachable: "), 0u) << report.reason;
}

TEST(Record, KeepsEveryTermAtEveryFrameWhetherItSucceedsOrNot) {
  World world(task("open_drawer"));
  world.reset(0, 1);
  int frames = 0;
  const RunReport done =
      run_script(world, world.episode().demonstration, {}, [&](const Frame&) { ++frames; });
  ASSERT_TRUE(done.success) << done.reason;
  ASSERT_EQ(done.terms.size(), 1u);
  const TermSeries& drawer = done.terms[0];
  EXPECT_EQ(static_cast<int>(drawer.values.size()), frames);
  EXPECT_EQ(drawer.at_end.unit, "m");
  EXPECT_NEAR(drawer.values.front(), 0, 1e-3) << "closed at the start";
  EXPECT_GT(drawer.values.back(), drawer.at_end.threshold);
  EXPECT_TRUE(drawer.met_at_end);
  // The first frame above the threshold is the one that ends within a frame after the term became true.
  std::size_t first = 0;
  while (drawer.values[first] <= drawer.at_end.threshold) ++first;
  EXPECT_LE(*drawer.first_met_s, 0.05 * static_cast<double>(first) + 1e-9);
  EXPECT_GT(*drawer.first_met_s, 0.05 * static_cast<double>(first - 1) - 1e-9);

  world.reset(0, 1);
  const RunReport failed = run_text(world, "steps:\n  - gripper: close\n");
  EXPECT_FALSE(failed.success);
  ASSERT_EQ(failed.terms.size(), 1u);
  EXPECT_GT(failed.terms[0].values.size(), 10u);
  EXPECT_FALSE(failed.terms[0].first_met_s.has_value());
  EXPECT_FALSE(failed.terms[0].met_at_end);
}

TEST(Record, UnknownFrameIsNamed) {
  World world(task("push_buttons"));
  world.reset(0, 1);
  const RunReport report =
      run_text(world, "steps:\n  - move: {frame: teapot, position: [0, 0, 0], rpy_deg: [180, 0, 0]}\n");
  EXPECT_FALSE(report.success);
  EXPECT_EQ(report.line, 2);
  EXPECT_NE(report.reason.find("teapot"), std::string::npos) << report.reason;
}

TEST(Record, WhatIsWrongWithAScriptIsKnownBeforeAnythingMoves) {
  World world(task("push_buttons"));
  world.reset(0, 1);
  const std::string late =
      "steps:\n  - gripper: close\n  - move: {position: [0, 0, 0],\n      frame: teapot, rpy_deg: [180, 0, "
      "0]}\n";
  EXPECT_FALSE(run_text(world, late).success);
  EXPECT_EQ(world.frame().time_s, 0) << "the gripper closed before the frame was looked for";
  const auto complaint = [&](const std::string& text) {
    try {
      check_script(parse_script(text, "user.yaml"), world.task());
    } catch (const BadScript& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(complaint(late).find("user.yaml:4:14: the scene has no frame 'teapot' (known: world, tool, "), 0u)
      << complaint(late);
  EXPECT_EQ(complaint("steps:\n- gripper: open\ntask: open_drawer\n"),
            "user.yaml:3:7: the script is for task 'open_drawer', the scene is 'push_buttons'");
  for (const char* frame : {"world", "tool", "attach"})
    EXPECT_EQ(complaint(std::string("steps:\n- move: {position: [0, 0, 1], rpy_deg: [0, 0, 0], frame: ") +
                        frame + "}\n"),
              "");
}

TEST(Record, AKeyframeFarAboveTheTaskWidensTheBoxOfItsDemonstration) {
  World world(task("push_buttons"));
  world.reset(0, 1);
  std::string text = world.episode().demonstration_text;
  const std::string head = "steps:\n";
  text.insert(text.find(head) + head.size(), "  - gripper: close\n");
  const RunReport report = run_script(world, parse_script(text, "user.yaml"),
                                      [](const SceneState&) { return Observation{}; }, {}, {});
  ASSERT_TRUE(report.success) << report.reason;
  const Box own = world.task().bounds();
  EXPECT_FALSE(own.contains(report.demo->keyframes.front().action.world_from_tool.position));
  EXPECT_TRUE(report.demo->bounds.contains(report.demo->keyframes.front().action.world_from_tool.position));
  EXPECT_EQ(report.demo->bounds.min.z(), own.min.z()) << "no farther than it must";
}

TEST(Record, WhatHasLeftTheWorkspaceIsNamed) {
  World world(task("insert_onto_square_peg"));
  world.reset(0, 1);
  const SceneState start = world.state();
  EXPECT_TRUE(lost_things(world, start).empty());
  SceneState fallen = start;
  int joint = 0;
  while (world.model()->jnt_type[joint] != mjJNT_FREE) ++joint;
  fallen.qpos[world.model()->jnt_qposadr[joint] + 2] = 0.01;
  world.restore(fallen);
  const auto lost = lost_things(world, start);
  ASSERT_EQ(lost.size(), 1u);
  EXPECT_NE(lost[0].find(" has left the workspace: 0.7"), std::string::npos) << lost[0];
  fallen.qpos[world.model()->jnt_qposadr[joint] + 2] = start.qpos[world.model()->jnt_qposadr[joint] + 2];
  fallen.qpos[world.model()->jnt_qposadr[joint]] = 1.4;
  world.restore(fallen);
  EXPECT_EQ(lost_things(world, start).size(), 1u) << "far away at the same height";
}

TEST(Record, CollisionSaysWithWhat) {
  World world(task("push_buttons"));
  world.reset(0, 1);
  const RunReport report =
      run_text(world, "steps:\n  - move: {position: [0.3, 0, 0.7], rpy_deg: [180, 0, 0], path: linear}\n");
  EXPECT_FALSE(report.success);
  EXPECT_NE(report.reason.find("in_collision"), std::string::npos) << report.reason;
  EXPECT_NE(report.reason.find("table"), std::string::npos) << report.reason;
}

TEST(Record, AScriptThatDoesTooLittleSaysWhichTermIsFalse) {
  World world(task("open_drawer"));
  world.reset(0, 1);
  const RunReport report = run_text(world, "steps:\n  - gripper: close\n");
  EXPECT_FALSE(report.success);
  EXPECT_EQ(report.line, 2);
  EXPECT_EQ(report.reason.find("success term "), 0u) << report.reason;
  EXPECT_NE(report.reason.find(" is false ("), std::string::npos) << report.reason;
}

TEST(Record, AScriptOfAnotherTaskIsRefused) {
  World world(task("open_drawer"));
  const RunReport report = run_text(world, "task: push_buttons\nsteps:\n  - gripper: close\n");
  EXPECT_FALSE(report.success);
  EXPECT_NE(report.reason.find("push_buttons"), std::string::npos);
  EXPECT_NE(report.reason.find("open_drawer"), std::string::npos);
}

TEST(Record, CancelledRunSaysSo) {
  World world(task("open_drawer"));
  world.reset(0, 1);
  std::stop_source stop;
  int frames = 0;
  const RunReport report = run_script(
      world, world.episode().demonstration, black,
      [&](const Frame&) {
        if (++frames == 10) stop.request_stop();
      },
      stop.get_token());
  EXPECT_FALSE(report.success);
  EXPECT_EQ(frames, 10);
  EXPECT_NE(report.reason.find("cancelled"), std::string::npos) << report.reason;
}

}  // namespace
}  // namespace flowscope
