// Older traces leave memory and come back as they were, bit for bit.
#include "app/trace_shelf.h"

#include <gtest/gtest.h>

#include "app/trace_store.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

/// Nothing of it is a default, and numbers have all their digits.
StoredTrace sample(int n) {
  StoredTrace stored;
  FlowTrace& t = stored.trace;
  t.policy_file = "live.flow";
  t.weights_sha256 = "abc";
  t.objective = "ddim";
  t.generation = 77;
  t.flow_steps = 2;
  t.seed = static_cast<std::uint64_t>(n);
  t.scene = {"push_buttons", 3, 9, "demo-1", 4, "fff"};
  t.instruction = "push the \xc3\xbc button";
  for (int k = 0; k < 3; ++k) {
    FlowStep step;
    step.k = k;
    step.t = k / 3.0;
    step.x = {0.1, 0.2, 1 / 3.0, 4, 5, 6, 7, 8, 9.0 * n};
    step.velocity[8] = -1e-300;
    step.pose.position = {1 / 7.0, 2, 3};
    step.pose.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()));
    step.region = {{0.3, 0.1, 0.9}, 0.2, 5, {{0.1f, 0.2f, 0.3f}, {1, 2, 3}}};
    step.open_probability = 0.25;
    step.ms = 3.5;
    step.weights = {0.5f, 0.25f};
    step.weight_points = {{4, 5, 6}};
    t.steps.push_back(step);
  }
  t.result.openness = 0.75;
  t.expert = GripperAction{t.steps[0].pose, 0.5};
  t.error = PoseError{0.01, 2, true};
  t.parent = FlowTrace::Parent{"trace-00001", 1};
  stored.state = {"push_buttons", 1.25, {1, 2}, {3}, {4}, {5}, {6}, {7}, {8}, {1, 0}, {9}, {0.5f}};
  auto input = std::make_shared<PolicyInput>();
  View view;
  view.camera = CameraModel::from_vertical_fov("front", 3, 2, 0.7, t.steps[0].pose);
  view.rgb = ImageRgb(3, 2);
  view.rgb.data[4] = 200;
  view.depth = DepthImage(3, 2);
  view.depth.data[5] = 1.0f / 3;
  input->observation.views = {view, view};
  input->instruction = t.instruction;
  input->history = {{t.steps[0].pose, 0.5, {1, 2, 3, 4, 5, 6, 7}}, {}};
  input->keyframe_index = 1;
  input->robot = "panda";
  stored.input = input;
  stored.episode = 12;
  return stored;
}

void expect_same(const StoredTrace& a, const StoredTrace& b) {
  EXPECT_EQ(a.state, b.state);
  EXPECT_EQ(a.episode, b.episode);
  EXPECT_EQ(a.input->observation, b.input->observation);
  EXPECT_EQ(a.input->instruction, b.input->instruction);
  EXPECT_EQ(a.input->robot, b.input->robot);
  EXPECT_EQ(a.input->keyframe_index, b.input->keyframe_index);
  ASSERT_EQ(a.input->history.size(), b.input->history.size());
  EXPECT_EQ(a.input->history[0].q, b.input->history[0].q);
  EXPECT_EQ(a.input->history[0].world_from_tool, b.input->history[0].world_from_tool);
  const FlowTrace &t = a.trace, &u = b.trace;
  EXPECT_EQ(t.instruction, u.instruction);
  EXPECT_EQ(t.scene.demo, u.scene.demo);
  EXPECT_EQ(t.scene.keyframe, u.scene.keyframe);
  EXPECT_EQ(t.expert, u.expert);
  EXPECT_EQ(t.result, u.result);
  EXPECT_EQ(t.parent->trace, u.parent->trace);
  EXPECT_EQ(t.error->rotation_deg, u.error->rotation_deg);
  ASSERT_EQ(t.steps.size(), u.steps.size());
  for (std::size_t k = 0; k < t.steps.size(); ++k) {
    const FlowStep &s = t.steps[k], &r = u.steps[k];
    EXPECT_EQ(s.x, r.x);
    EXPECT_EQ(s.velocity, r.velocity);
    EXPECT_EQ(s.pose, r.pose);
    EXPECT_EQ(s.region.inside, r.region.inside);
    EXPECT_EQ(s.region.center, r.region.center);
    EXPECT_EQ(s.weights, r.weights);
    EXPECT_EQ(s.weight_points, r.weight_points);
    EXPECT_EQ(s.open_probability, r.open_probability);
  }
}

TEST(TraceShelf, GivesBackWhatItGot) {
  const testing::TemporaryFolder folder;
  TraceShelf shelf(folder.path());
  EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << "nothing is left when the program dies";
  const StoredTrace first = sample(1), second = sample(2);
  const auto here = shelf.put(first), there = shelf.put(second);
  expect_same(shelf.take(there), second);
  shelf.drop(there);
  expect_same(shelf.take(here), first);
  EXPECT_EQ(shelf.take(shelf.put({})).input, nullptr);
}

TEST(TraceStore, KeepsTheNewestInMemoryAndKnowsThemAll) {
  const testing::TemporaryFolder folder;
  TraceStore store(folder.path());
  std::vector<std::string> ids;
  std::vector<std::weak_ptr<const PolicyInput>> inputs;
  constexpr int count = static_cast<int>(TraceStore::newest_in_memory) + 5;
  for (int i = 0; i < count; ++i) {
    StoredTrace stored = sample(i);
    inputs.push_back(stored.input);
    ids.push_back(store.add(std::move(stored)));
  }
  for (int i = 0; i < count; ++i) {
    EXPECT_EQ(inputs[static_cast<std::size_t>(i)].expired(), i < 5) << i;
    const auto stored = store.get(ids[static_cast<std::size_t>(i)]);
    EXPECT_EQ(stored->trace.id, ids[static_cast<std::size_t>(i)]);
    expect_same(*stored, sample(i));
  }
  EXPECT_EQ(store.list().size(), ids.size());
  store.remove(ids.front());
  store.remove(ids.back());
  EXPECT_THROW(store.get(ids.front()), web::ApiError);
  EXPECT_EQ(store.list().size(), ids.size() - 2);
}

}  // namespace
}  // namespace flowscope
