// Recording on the sim thread: reset and run are one, whatever else was asked for at the same moment.
#include <gtest/gtest.h>

#include "app/sim_loop.h"
#include "recorder/demo_check.h"

namespace flowscope {
namespace {

class SimRecord : public ::testing::Test {
 protected:
  SimRecord() : tasks(find_assets()), sim(tasks) {
    sim.reset("push_buttons", 0, 1).get();
    own = parse_script(sim.snapshot().get()->script_text);
  }
  static Observation no_picture(const SceneState&) { return {}; }

  TaskLibrary tasks;
  SimLoop sim;
  Script own;
  const SimLoop::Placement here{"push_buttons", 0, 1};
};

TEST_F(SimRecord, EveryRecordingBeginsAtTheResetSceneWhateverRanBefore) {
  std::vector<std::future<RunReport>> recordings, runs;
  for (int i = 0; i < 2; ++i) {  // all wait before the first has begun
    runs.push_back(sim.run_script(here, own, {}));
    recordings.push_back(sim.record_script(here, own, no_picture, {}));
  }
  std::vector<std::size_t> lengths;
  for (auto& recording : recordings) {
    const RunReport report = recording.get();
    ASSERT_TRUE(report.demo) << report.reason;
    EXPECT_EQ(report.demo->frames.front().time_s, 0);
    lengths.push_back(report.demo->frames.size());
  }
  EXPECT_GT(lengths[0], 20u);
  EXPECT_EQ(lengths[0], lengths[1]) << "the same placement, the same motion";
  EXPECT_TRUE(runs[1].get().success);
}

TEST_F(SimRecord, AScriptIsNotRunInAnotherSceneThanItWasGivenFor) {
  const auto reset = sim.reset("open_drawer", 0, 1);
  auto recording = sim.record_script(here, own, no_picture, {});
  auto run = sim.run_script(here, own, {});
  EXPECT_THROW(recording.get(), SimLoop::SceneChanged);
  EXPECT_THROW(run.get(), SimLoop::SceneChanged);
  EXPECT_EQ(sim.snapshot().get()->task, "open_drawer");
  const std::uint64_t over = sim.snapshot().get()->episode - 1;
  EXPECT_THROW(sim.execute({}, 0, over, {}).get(), SimLoop::SceneChanged);
}

TEST_F(SimRecord, WhatWasCancelledBeforeItBeganLeavesTheSceneAlone) {
  const std::uint64_t episode = sim.snapshot().get()->episode;
  std::stop_source stop;
  stop.request_stop();
  const RunReport report = sim.record_script(here, own, no_picture, stop.get_token()).get();
  EXPECT_FALSE(report.success);
  EXPECT_FALSE(report.demo);
  EXPECT_EQ(sim.snapshot().get()->episode, episode);
}

}  // namespace
}  // namespace flowscope
