#include "recorder/demo_trim.h"

#include <gtest/gtest.h>

#include "recorder/demo_check.h"
#include "recorder/demo_stats.h"
#include "tests/support/sample_demo.h"

namespace flowscope {
namespace {

using testing::sample_demo;
using testing::sample_observation;

/// The sample with `before` still frames in front of it and `after` behind it.
Demo with_idle_ends(int before, int after) {
  Demo demo = sample_demo();
  const auto still = [](Frame frame) {
    for (double& dq : frame.dq) dq = 0;
    for (double& v : frame.state.qvel) v = 0;
    return frame;
  };
  std::vector<Frame> frames(static_cast<std::size_t>(before), still(demo.frames.front()));
  frames.insert(frames.end(), demo.frames.begin(), demo.frames.end());
  frames.insert(frames.end(), static_cast<std::size_t>(after), still(demo.frames.back()));
  for (std::size_t i = 0; i < frames.size(); ++i) {
    frames[i].time_s = frames[i].state.time_s = 0.05 * static_cast<double>(i);
  }
  demo.frames = frames;
  for (Keyframe& keyframe : demo.keyframes) keyframe.frame += before;
  demo.keyframes.back().frame += after;
  return demo;
}

/// A picture that tells when it was taken.
Observation stamped(const SceneState& state) { return sample_observation(1000 * state.time_s); }

TEST(DemoTrim, NothingIsCutFromWhatMovesAllTheTime) {
  EXPECT_EQ(busy_span(sample_demo()), (FrameSpan{0, 19}));
}

TEST(DemoTrim, IdleEndsGoAndWhatStaysIsExact) {
  const Demo demo = with_idle_ends(6, 5);
  ASSERT_EQ(demo.frames.size(), 31u);
  const FrameSpan span = busy_span(demo);
  EXPECT_EQ(span, (FrameSpan{6, 26})) << "one still frame stays at the end, the first at rest";
  const Demo cut = trimmed(demo, span, stamped);
  ASSERT_EQ(cut.frames.size(), 21u);
  for (std::size_t i = 0; i < cut.frames.size(); ++i) {
    EXPECT_EQ(cut.frames[i].state, demo.frames[i + 6].state) << i;
    EXPECT_EQ(cut.frames[i].time_s, demo.frames[i + 6].time_s);
  }
  EXPECT_EQ(cut.start, stamped(demo.frames[6].state));
  ASSERT_EQ(cut.keyframes.size(), 2u);
  EXPECT_EQ(cut.keyframes[0].frame, 10);
  EXPECT_EQ(cut.keyframes[0].observation, demo.keyframes[0].observation) << "its moment has not changed";
  EXPECT_EQ(cut.keyframes[1].frame, 20);
  EXPECT_EQ(cut.keyframes[1].observation, stamped(demo.frames[26].state));
  EXPECT_EQ(cut.info.frames, 21);
  EXPECT_EQ(find_incoherence(cut), "");
  EXPECT_EQ(busy_span(cut), (FrameSpan{0, 20})) << "a second time there is nothing left to cut";
}

TEST(DemoTrim, AnIdleStartAloneLeavesTheEndItsPicture) {
  const Demo demo = with_idle_ends(4, 0);
  const Demo cut = trimmed(demo, busy_span(demo), stamped);
  EXPECT_EQ(cut.frames.size(), 20u);
  EXPECT_EQ(cut.keyframes[1].observation, demo.keyframes[1].observation);
  EXPECT_EQ(cut.keyframes[1].action, demo.keyframes[1].action);
}

TEST(DemoTrim, AKeyframeInTheIdleStartEndsTheCut) {
  Demo demo = with_idle_ends(6, 0);
  demo.keyframes.insert(demo.keyframes.begin(), demo.keyframes.front());
  demo.keyframes.front().frame = 3;
  const FrameSpan span = busy_span(demo);
  EXPECT_EQ(span.first, 2);
  EXPECT_EQ(trimmed(demo, span, stamped).keyframes.front().frame, 1);
  EXPECT_THROW(trimmed(demo, {3, 25}, stamped), std::invalid_argument);
}

TEST(DemoTrim, AMovingObjectOrGripperIsNoIdling) {
  Demo demo = with_idle_ends(6, 0);
  for (std::size_t i = 2; i < demo.frames.size(); ++i) demo.frames[i].state.qpos.back() += 0.002;
  EXPECT_EQ(busy_span(demo).first, 1);
  demo = with_idle_ends(6, 0);
  for (int i = 0; i < 3; ++i) demo.frames[i].gripper_open = false;
  EXPECT_EQ(busy_span(demo).first, 2);
}

TEST(DemoTrim, WhatPassesItsLastPlaceAtSpeedHasNotArrived) {
  Demo demo = with_idle_ends(0, 4);
  demo.frames[21].state.qvel[0] = 0.5;
  EXPECT_EQ(busy_span(demo).last, 22);
}

TEST(DemoStats, CountWhatTheFramesSay) {
  TaskStats stats;
  Demo demo = sample_demo();
  demo.info.bytes = 1000;
  stats.add(demo);
  demo.info.variation = 7;
  demo.keyframes.pop_back();
  demo.frames.resize(11);
  demo.keyframes[0].action.world_from_tool.position.z() = 1.61;
  stats.add(demo);
  EXPECT_EQ(stats.demos, 2);
  EXPECT_EQ(stats.by_variation, (std::map<int, int>{{3, 1}, {7, 1}}));
  EXPECT_EQ(stats.frames.sum, 31);
  EXPECT_EQ(stats.keyframes.mean(), 1.5);
  EXPECT_EQ(stats.keyframes.min, 1);
  EXPECT_NEAR(stats.seconds.max, 0.95, 1e-9);
  EXPECT_EQ(stats.gripper_events.sum, 2);
  EXPECT_NEAR(stats.tool_speed_m_s.mean(), 0.2, 1e-9);
  EXPECT_NEAR(stats.max_joint_speed, 0.2, 0.01);
  EXPECT_NEAR(stats.tool_extent.max.x(), 0.1 + 0.19, 1e-9);
  EXPECT_NEAR(stats.tool_extent.min.x(), 0.1, 1e-9);
  EXPECT_EQ(stats.keyframes_outside, 1);
  EXPECT_EQ(stats.bytes, 2000u);
}

}  // namespace
}  // namespace flowscope
