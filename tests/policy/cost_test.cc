// The costs that are computed from the sizes, against the matrix products that a forward pass makes.
#include "policy/cost.h"

#include <gtest/gtest.h>
#include <torch/csrc/autograd/profiler_legacy.h>

#include <functional>
#include <numeric>

#include "policy/model.h"
#include "policy/summary.h"

namespace flowscope {
namespace {

/// Multiply-adds of aten::mm, addmm, bmm and baddbmm, which every other product is made of, from the shapes
/// that torch's own profiler records.
template <typename Call>
std::int64_t products_of(Call&& call) {
  using namespace torch::autograd::profiler;
  enableProfilerLegacy({torch::profiler::impl::ProfilerState::CPU, /*report_input_shapes=*/true});
  call();
  std::int64_t sum = 0;
  for (const auto& thread : disableProfilerLegacy()) {
    for (const LegacyEvent& event : thread) {
      const std::string name = event.name();
      const std::size_t first = name == "aten::addmm" || name == "aten::baddbmm" ? 1 : 0;
      if (event.kindStr() != "push" || (first == 0 && name != "aten::mm" && name != "aten::bmm")) continue;
      const std::vector<std::int64_t> left = event.shapes().at(first), right = event.shapes().at(first + 1);
      sum += std::accumulate(left.begin(), left.end(), std::int64_t{1}, std::multiplies<>()) * right.back();
    }
  }
  return sum;
}

SceneBatch any_scene(const NetworkShape& s) {
  const std::int64_t w = s.words, m = s.image_tokens;
  SceneBatch b;
  b.word_row = torch::ones({1, w}, torch::kInt64);
  b.word_mention = torch::zeros({1, w}, torch::kInt64);
  b.word_color = torch::rand({1, w, 3});
  if (s.text_branch == "clip") b.word_feature = torch::rand({1, w, 512});
  b.image_feature = torch::rand({1, m, point_features});
  b.image_position = torch::rand({1, m, 3});
  b.image_moments = torch::rand({1, m, 4});
  b.image_color = torch::rand({1, m, 3});
  b.patches = torch::rand({1, m, patch_values});
  b.history = torch::rand({1, history_length, history_features});
  b.history_position = torch::rand({1, history_length, 3});
  b.tool_axes = torch::eye(3).unsqueeze(0);
  b.keyframe_index = torch::zeros({1}, torch::kInt64);
  return b;
}

DrawBatch any_draw(const NetworkShape& s) {
  const std::int64_t n = s.region_points;
  DrawBatch b;
  b.x = torch::rand({1, 9});
  b.t = torch::rand({1});
  b.region_feature = torch::rand({1, n, region_features});
  b.region_position = torch::rand({1, n, 3});
  b.region_place = torch::rand({1, n, 3});
  b.region_moments = torch::rand({1, n, 4});
  b.region_color = torch::rand({1, n, 3});
  return b;
}

Work sum_of(const std::map<std::string, PartWork>& parts, Work PartWork::*when) {
  Work sum;
  for (const auto& [name, part] : parts) sum += part.*when;
  return sum;
}

struct Case {
  std::string name, backbone = "mamba";
  void (*change)(NetworkShape&) = [](NetworkShape&) {};
};
std::ostream& operator<<(std::ostream& out, const Case& c) { return out << c.name; }

class Cost : public ::testing::TestWithParam<Case> {};

TEST_P(Cost, IsWhatAForwardPassMultiplies) {
  NetworkShape shape = load_preset("nano").shape;
  shape.prefix_blocks = 2;
  shape.velocity_blocks = 3;
  GetParam().change(shape);
  FlowRamNetwork network(shape, GetParam().backbone);
  const auto parts = cost_of(shape, GetParam().backbone);
  // Gradients stay on: without them a stack may go by kernels of its own, which nobody could count.
  SceneMemory memory;
  EXPECT_EQ(products_of([&] { memory = network->encode(any_scene(shape)); }),
            sum_of(parts, &PartWork::scene).products);
  EXPECT_EQ(products_of([&] { network->forward(memory, any_draw(shape), {}); }),
            sum_of(parts, &PartWork::step).products);
  for (const auto& [name, part] : parts)
    EXPECT_TRUE(network->named_children().contains(name)) << name << " is no part of the network";
}

INSTANTIATE_TEST_SUITE_P(
    Shapes, Cost,
    ::testing::Values(
        Case{"carried"}, Case{"stored", "mamba", [](NetworkShape& s) { s.stored_state = true; }},
        Case{"paper_order", "mamba", [](NetworkShape& s) { s.paper_order = true; }},
        Case{"plain_form", "mamba", [](NetworkShape& s) { s.grounded = false; }},
        Case{"no_binding", "mamba", [](NetworkShape& s) { s.binding = false; }},
        Case{"no_point_encoder", "mamba", [](NetworkShape& s) { s.point_encoder = false; }},
        Case{"groups", "mamba", [](NetworkShape& s) { s.point_groups = 8, s.group_size = 4; }},
        Case{"clip_text", "mamba", [](NetworkShape& s) { s.text_branch = "clip"; }},
        Case{"transformer", "transformer"},
        Case{"transformer_stored", "transformer", [](NetworkShape& s) { s.stored_state = true; }},
        Case{"transformer_paper_order", "transformer", [](NetworkShape& s) { s.paper_order = true; }}),
    [](const auto& chosen) { return chosen.param.name; });

TEST(CostOfMamba, CountsItsRecurrences) {
  NetworkShape shape = load_preset("nano").shape;
  shape.point_blocks = 2;
  const Work work = cost_of(shape, "mamba").at("point_encoder").step;
  const int inner = 2 * shape.channels;  // expand 2, d_conv 4
  EXPECT_EQ(work.recurrences, 2ll * shape.region_points * inner * (4 + 3 * shape.d_state));
  EXPECT_EQ(cost_of(shape, "transformer").at("point_encoder").step.recurrences, 0);
  EXPECT_THROW(cost_of(shape, "lstm"), std::invalid_argument);
}

TEST(PolicySummary, CountsEveryParameterOfEveryPart) {
  const PolicySummary summary = summarise_preset("nano", "mamba");
  const Model model = make_model(summary.shape, summary.radius, "mamba", "cfm", 1);
  std::int64_t wanted = 0, found = 0;
  for (const torch::Tensor& p : model.network->parameters()) wanted += p.numel();
  for (const PartSummary& part : summary.parts) found += part.parameters;
  EXPECT_EQ(found, wanted);
  EXPECT_EQ(summary.parameters, wanted);
  EXPECT_GT(summary.scene.products, 0);
  EXPECT_GT(summary.step.recurrences, 0);
}

}  // namespace
}  // namespace flowscope
