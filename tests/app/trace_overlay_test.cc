// What a step of a trace looks like as things to draw, and where traces are kept.
#include "app/trace_overlay.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "app/evaluate.h"
#include "app/trace_store.h"
#include "app/training_set.h"

namespace flowscope {
namespace {

FlowTrace small_trace() {
  FlowTrace trace;
  trace.flow_steps = 2;
  for (int k = 0; k <= 2; ++k) {
    FlowStep step;
    step.k = k;
    step.t = 0.5 * k;
    step.pose.position = {0.1 * k, 0, 1};
    step.region.center = step.pose.position;
    step.region.radius_m = 0.4 - 0.1 * k;
    step.region.points = 2;
    step.region.inside = {{0, 0, 1}, {0.1f, 0, 1}};
    trace.steps.push_back(step);
  }
  trace.result.world_from_tool = trace.steps.back().pose;
  return trace;
}

TEST(TraceOverlay, SamplesShowEveryWholeFlowItsEndAndOneExpert) {
  FlowTrace other = small_trace();
  other.steps.front().pose.position = {0, 0.3, 1.2};
  other.result.world_from_tool.position = {0.25, 0.1, 0.9};
  std::vector<FlowTrace> samples{small_trace(), other};
  for (FlowTrace& s : samples) s.expert = GripperAction{{{0.2, 0, 0.8}, Eigen::Quaterniond::Identity()}, 1};
  const Overlay o = overlay_of_samples(samples);
  ASSERT_EQ(o.lines.size(), 2u);
  EXPECT_EQ(o.lines[1].points.size(), 3u);
  EXPECT_EQ(o.lines[1].points.front(), other.steps.front().pose.position);
  ASSERT_EQ(o.ghosts.size(), 3u);
  EXPECT_EQ(o.ghosts[1].world_from_tool.position, other.result.world_from_tool.position);
  EXPECT_EQ(o.ghosts[2].world_from_tool.position, samples[0].expert->world_from_tool.position);
  EXPECT_TRUE(overlay_of_samples({}).ghosts.empty());
}

TEST(TraceOverlay, ShowsSpherePointsPathAndGhost) {
  const FlowTrace trace = small_trace();
  const Overlay o = overlay_of(trace, 1);
  ASSERT_EQ(o.spheres.size(), 1u);
  EXPECT_DOUBLE_EQ(o.spheres[0].radius_m, 0.3);
  EXPECT_EQ(o.spheres[0].center, trace.steps[1].pose.position);
  EXPECT_EQ(o.points[0].points.size(), 2u);
  ASSERT_EQ(o.lines.size(), 2u);  // so far, and to come
  EXPECT_EQ(o.lines[0].points.size(), 2u);
  EXPECT_EQ(o.ghosts.size(), 1u);
}

TEST(TraceOverlay, ExpertGetsAGhostOfItsOwnAndStepsAreClamped) {
  FlowTrace trace = small_trace();
  trace.expert = GripperAction{};
  EXPECT_EQ(overlay_of(trace, 99).ghosts.size(), 2u);
  EXPECT_EQ(overlay_of(trace, 99).lines.size(), 1u);  // nothing is to come
  EXPECT_EQ(overlay_of(trace, -5).lines.size(), 1u);  // nothing lies behind
  EXPECT_TRUE(overlay_of(FlowTrace{}, 0).spheres.empty());
}

TEST(TraceStore, KeepsTracesInFilesAndNeverReusesAnId) {
  const auto folder = std::filesystem::temp_directory_path() / "flowscope_trace_store_test";
  std::filesystem::remove_all(folder);
  std::string first;
  {
    TraceStore store(folder);
    StoredTrace stored;
    stored.trace = small_trace();
    first = store.add(stored);
    EXPECT_EQ(store.get(first)->trace.steps.size(), 3u);
    std::ifstream in(folder / (first + ".json"));
    const auto json = nlohmann::json::parse(in);
    EXPECT_EQ(json.at("format"), "flowscope-trace/1");
    EXPECT_EQ(json.at("steps").size(), 3u);
  }
  TraceStore again(folder);
  const std::string second = again.add({small_trace(), {}, nullptr, 0});
  EXPECT_NE(first, second);
  EXPECT_THROW(again.get(first), web::ApiError);  // its scene is gone with the program that made it
  again.remove(second);
  EXPECT_FALSE(std::filesystem::exists(folder / (second + ".json")));
  EXPECT_THROW(again.remove(second), web::ApiError);
  std::filesystem::remove_all(folder);
}

TEST(TrainingSet, OneInTwentyIsHeldOut) {
  int held = 0;
  for (std::size_t i = 0; i < 100; ++i) held += held_out(i);
  EXPECT_EQ(held, 5);
  EXPECT_FALSE(held_out(0));  // the very first demonstration trains
}

TEST(Evaluation, ScenesAreApartFromRecordedOnesAndSpreadOverVariations) {
  std::vector<int> seen(50, 0);
  for (int s = 0; s < 3; ++s) {
    for (int e = 0; e < 100; ++e) {
      EXPECT_GE(eval_seed(s, e), 1'000'000u);
      ++seen.at(eval_variation(50, s, e));
    }
  }
  EXPECT_GT(std::count_if(seen.begin(), seen.end(), [](int n) { return n > 0; }), 40);
}

}  // namespace
}  // namespace flowscope
