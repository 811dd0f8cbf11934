// What the policy is given counts, and a point that it does not look at changes not one bit.
#include <gtest/gtest.h>

#include <functional>
#include <set>

#include "policy/integrate.h"
#include "policy/trainer.h"
#include "tests/support/nano_model.h"

namespace flowscope {
namespace {

using testing::nano_demo;
using testing::nano_model;
using testing::nano_scene;
using testing::NanoKind;

TEST(Influence, EverythingThePolicyIsGivenCounts) {
  TrainOptions how;
  how.preset = "nano";
  how.seed = 5;
  const auto trainer = Trainer::create(how);
  trainer->add(nano_demo());
  for (int i = 0; i < 5; ++i) trainer->step();
  PredictOptions options;
  const PolicyInput input = input_of_keyframe(nano_demo(), 1);
  const Vector9 before = trainer->predict(input, options).steps[1].velocity;
  const auto changes = [&](const std::function<void(PolicyInput&)>& edit) {
    PolicyInput edited = input;
    edit(edited);
    return trainer->predict(edited, options).steps[1].velocity != before;
  };
  EXPECT_TRUE(changes([](PolicyInput& i) { i.instruction = "push the white button"; }));
  EXPECT_TRUE(changes([](PolicyInput& i) { i.instruction += " now"; }));
  EXPECT_TRUE(changes([](PolicyInput& i) { i.history.front().q[3] += 0.1; }));
  EXPECT_TRUE(changes([](PolicyInput& i) { i.history.back().world_from_tool.position.x() += 0.01; }));
  EXPECT_TRUE(changes([](PolicyInput& i) { i.history.back().openness = 0.3; }));
  EXPECT_TRUE(changes([](PolicyInput& i) { i.keyframe_index = 3; }));
  EXPECT_TRUE(changes([](PolicyInput& i) {
    for (auto& v : i.observation.views[0].rgb.data) v = static_cast<std::uint8_t>(255 - v);
  }));
  EXPECT_FALSE(changes([](PolicyInput& i) {  // a far wall, outside the workspace
    for (auto& v : i.observation.views)
      for (auto& d : v.depth.data)
        if (d == 0) d = 3.9f;
  }));
}

/// One step from a late state in the middle of the workspace: at noise a diffusion's plain answer would be
/// cut off at the workspace's border, whatever it is.
FlowTrace predict(Model& model, const SceneInput& input) {
  FlowTrace before;
  before.flow_steps = 1;
  before.steps.resize(2);
  before.steps[0].t = 0.75;
  for (std::size_t i = 0; i < 9; ++i) before.steps[0].x[i] = 0.1 * static_cast<double>(i) - 0.4;
  PredictOptions options;
  options.flow_steps = 1;
  options.branch = PredictOptions::Branch{&before, 0, std::nullopt, std::nullopt, std::nullopt};
  return integrate_flow(model, input, options);
}

/// The scene with something changed in what was prepared of its pictures.
SceneInput with_scene(const std::function<void(PreparedScene&)>& edit) {
  auto scene = std::make_shared<PreparedScene>(*nano_scene().scene);
  edit(*scene);
  SceneInput input = nano_scene();
  input.scene = scene;
  return input;
}

void paint(ScenePoint& point) { point.color = Eigen::Vector3f::Ones() - point.color; }

/// Of the points that are no image tokens: one inside the first step's sphere, one in no step's selection.
struct Points {
  std::size_t inside = 0, outside = 0;
};

Points find_points(const Model& model, const FlowTrace& trace) {
  const auto& scene = *nano_scene().scene;
  const auto image_tokens = static_cast<std::size_t>(model.shape.image_tokens);
  std::set<std::size_t> selected, inside;
  for (const FlowStep& s : trace.steps) {
    const RegionPoints region =
        select_region(scene.points, s.region.center.cast<float>(), static_cast<float>(s.region.radius_m),
                      model.shape.region_points);
    for (std::size_t i = 0; i < region.index.size(); ++i) {
      const auto at = static_cast<std::size_t>(region.index[i]);
      selected.insert(at);
      if (s.k == 0 && region.inside[i] && at >= image_tokens) inside.insert(at);
    }
  }
  Points found{inside.empty() ? 0 : *inside.begin(), image_tokens};
  while (selected.contains(found.outside)) ++found.outside;
  return found;
}

struct Change {
  const char* what;
  std::function<SceneInput()> make;
};

const std::vector<Change>& changes() {
  const auto edited = [](const std::function<void(SceneInput&)>& edit) {
    return [edit] {
      SceneInput input = nano_scene();
      edit(input);
      return input;
    };
  };
  static const std::vector<Change> all{
      {"a word", edited([](SceneInput& i) { i.words.pop_back(); })},
      {"a colour word's colour", edited([](SceneInput& i) {
         for (Word& w : i.words) w.color = Eigen::Vector3f::Ones() - w.color;
       })},
      {"a joint", edited([](SceneInput& i) { i.history.front().q[3] += 0.1; })},
      {"the tool", edited([](SceneInput& i) { i.history.back().world_from_tool.position.x() += 0.01; })},
      {"the gripper", edited([](SceneInput& i) { i.history.back().openness = 0.3; })},
      {"the keyframe's number", edited([](SceneInput& i) { i.keyframe_index += 2; })},
      {"the pictures",
       [] {
         return with_scene([](PreparedScene& scene) {
           for (auto& patch : scene.patches)
             for (float& v : patch) v = 1 - v;
         });
       }},
  };
  return all;
}

class InfluenceOfEveryKind : public ::testing::TestWithParam<NanoKind> {};

TEST_P(InfluenceOfEveryKind, WhatIsGivenCountsAndWhatIsOutsideDoesNot) {
  Model model = nano_model(GetParam());
  const FlowTrace before = predict(model, nano_scene());
  for (const auto& [what, make] : changes())
    EXPECT_NE(predict(model, make()).steps[0].velocity, before.steps[0].velocity) << what;

  const Points points = find_points(model, before);
  ASSERT_GT(points.inside, 0u);
  ASSERT_LT(points.outside, nano_scene().scene->points.size());
  const auto painted = [&](std::size_t i) {
    return predict(model, with_scene([i](PreparedScene& s) { paint(s.points[i]); }));
  };
  EXPECT_NE(painted(points.inside).steps[0].velocity, before.steps[0].velocity);
  const FlowTrace same = painted(points.outside);
  for (std::size_t k = 0; k < before.steps.size(); ++k) {
    EXPECT_EQ(same.steps[k].x, before.steps[k].x) << k;
    EXPECT_EQ(same.steps[k].velocity, before.steps[k].velocity) << k;
    EXPECT_EQ(same.steps[k].open_probability, before.steps[k].open_probability) << k;
  }
}

std::vector<NanoKind> every_kind() {
  std::vector<NanoKind> kinds;
  for (const char* backbone : {"mamba", "transformer"})
    for (const char* objective : {"cfm", "ddim", "ddpm"})
      for (const testing::TokenOrder order : testing::token_orders)
        for (const bool grounded : {true, false}) kinds.push_back({backbone, objective, order, grounded});
  return kinds;
}

std::string test_name(const ::testing::TestParamInfo<NanoKind>& info) {
  const NanoKind& k = info.param;
  return k.backbone + "_" + k.objective + "_" + testing::name_of(k.order) + (k.grounded ? "" : "_plain");
}

INSTANTIATE_TEST_SUITE_P(Policies, InfluenceOfEveryKind, ::testing::ValuesIn(every_kind()), test_name);

}  // namespace
}  // namespace flowscope
