#include "policy/fused_stack.h"

#include <gtest/gtest.h>

#include "policy/mamba_stack.h"

namespace flowscope {
namespace {

struct Form {
  MambaOptions options;
  std::int64_t items, length;
};

/// Blocks off their zero start, so that every part carries something.
std::vector<MambaBlock> random_blocks(const MambaOptions& options, int count = 3) {
  const torch::NoGradGuard no_grad;
  std::vector<MambaBlock> blocks;
  for (int i = 0; i < count; ++i) {
    blocks.emplace_back(options);
    for (auto& parameter : blocks.back()->parameters()) parameter.add_(0.1 * torch::randn_like(parameter));
  }
  return blocks;
}

torch::Tensor by_operators(std::vector<MambaBlock>& blocks, BackboneState& state, const torch::Tensor& x,
                           const torch::Tensor& condition) {
  const torch::NoGradGuard no_grad;
  state.resize(blocks.size());
  torch::Tensor y = x;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    MambaState block{state[i].first, state[i].second};
    y = blocks[i]->forward_from(block, y, condition);
    state[i] = {block.conv_tail, block.h};
  }
  return y;
}

torch::Tensor random_condition(const MambaOptions& options, std::int64_t items) {
  return options.condition_dim > 0 ? torch::randn({items, options.condition_dim}) : torch::Tensor();
}

/// Largest difference relative to the largest entry.
double distance(const torch::Tensor& a, const torch::Tensor& b) {
  if (b.numel() == 0) return 0;
  return ((a - b).abs().max() / b.abs().max().clamp_min(1e-9)).item<double>();
}

class FusedStackForm : public testing::TestWithParam<Form> {};

TEST_P(FusedStackForm, EqualsTheOperatorsFromNothingAndFromAState) {
  torch::manual_seed(31);
  const auto& [options, items, length] = GetParam();
  auto blocks = random_blocks(options);
  const torch::Tensor first = torch::randn({items, 5, options.d_model}),
                      second = torch::randn({items, length, options.d_model}),
                      condition = random_condition(options, items);
  BackboneState exact_state;
  const torch::Tensor exact_first = by_operators(blocks, exact_state, first, condition);
  const BackboneState between = exact_state;
  const torch::Tensor exact_second = by_operators(blocks, exact_state, second, condition);
  for (const MambaKernels* kernels : supported_mamba_kernels()) {
    SCOPED_TRACE(kernels->name);
    FusedStack fused(*kernels);
    BackboneState own, given = between;
    EXPECT_LT(distance(fused.run(blocks, own, first, condition), exact_first), 1e-4);
    for (BackboneState* state : {&own, &given}) {
      EXPECT_LT(distance(fused.run(blocks, *state, second, condition), exact_second), 1e-4);
      ASSERT_EQ(state->size(), blocks.size());
      for (std::size_t i = 0; i < blocks.size(); ++i) {
        ASSERT_EQ((*state)[i].first.sizes(), exact_state[i].first.sizes());
        ASSERT_EQ((*state)[i].second.sizes(), exact_state[i].second.sizes());
        EXPECT_LT(distance((*state)[i].first, exact_state[i].first), 1e-4) << "conv tail of block " << i;
        EXPECT_LT(distance((*state)[i].second, exact_state[i].second), 1e-4) << "state of block " << i;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Forms, FusedStackForm,
    testing::Values(Form{{.d_model = 24, .d_state = 16}, 1, 40},
                    Form{{.d_model = 24, .d_state = 8, .condition_dim = 7}, 3, 1},
                    Form{{.d_model = 13, .d_state = 4, .expand = 1}, 2, 2},
                    Form{{.d_model = 17, .d_state = 5, .expand = 3, .condition_dim = 3}, 2, 301},
                    Form{{.d_model = 9, .d_state = 16, .d_conv = 1}, 1, 33},
                    Form{{.d_model = 40, .d_state = 16, .d_conv = 3, .condition_dim = 5}, 1, 700}));

TEST(FusedStack, GivesTheSameBitsForAnyThreadCountAndAnyCut) {
  torch::manual_seed(32);
  const MambaOptions options{.d_model = 20, .d_state = 8, .condition_dim = 4};
  const auto blocks = random_blocks(options);
  const torch::Tensor x = torch::randn({2, 700, 20}), condition = random_condition(options, 2);
  const int threads = at::get_num_threads();
  FusedStack fused;
  at::set_num_threads(1);
  BackboneState whole_state;
  const torch::Tensor whole = fused.run(blocks, whole_state, x, condition);
  for (const int count : {2, 3, 5}) {
    at::set_num_threads(count);
    for (const std::int64_t cut : {1, 2, 300, 699}) {
      BackboneState state;
      const torch::Tensor head = fused.run(blocks, state, x.narrow(1, 0, cut), condition);
      const torch::Tensor tail = fused.run(blocks, state, x.narrow(1, cut, 700 - cut), condition);
      EXPECT_TRUE(torch::equal(torch::cat({head, tail}, 1), whole)) << count << " threads, cut at " << cut;
      EXPECT_TRUE(torch::equal(state.back().second, whole_state.back().second)) << count << " threads";
    }
  }
  at::set_num_threads(threads);
}

TEST(FusedStack, LeavesACopiedStateAlone) {
  torch::manual_seed(33);
  const MambaOptions options{.d_model = 16, .d_state = 4};
  const auto blocks = random_blocks(options);
  FusedStack fused;
  BackboneState stored;
  fused.run(blocks, stored, torch::randn({1, 30, 16}), {});
  const torch::Tensor tail = stored[0].first.clone(), h = stored[0].second.clone(),
                      x = torch::randn({1, 9, 16});
  BackboneState once = stored, again = stored;
  const torch::Tensor y = fused.run(blocks, once, x, {});
  EXPECT_TRUE(torch::equal(y, fused.run(blocks, again, x, {})));
  EXPECT_TRUE(torch::equal(stored[0].first, tail) && torch::equal(stored[0].second, h));
  EXPECT_FALSE(torch::equal(once[0].second, h));
}

TEST(FusedStack, RunsRepeatedRowsOfAState) {
  torch::manual_seed(34);
  const auto blocks = random_blocks({.d_model = 16, .d_state = 4});
  FusedStack fused;
  BackboneState stored;
  fused.run(blocks, stored, torch::randn({2, 30, 16}), {});
  BackboneState repeated = repeat_rows(stored, 3), alone;
  const torch::Tensor x = torch::randn({6, 9, 16});
  const torch::Tensor y = fused.run(blocks, repeated, x, {});
  for (const auto& [tail, h] : stored) alone.emplace_back(tail.narrow(0, 1, 1), h.narrow(0, 1, 1));
  EXPECT_TRUE(torch::equal(fused.run(blocks, alone, x.narrow(0, 5, 1), {}), y.narrow(0, 5, 1)));
}

TEST(MambaStack, TakesTheFusedPathWithoutGradientsOnly) {
  torch::manual_seed(35);
  MambaStack stack({.channels = 16, .d_state = 4, .blocks = 2, .condition_dim = 3});
  torch::Tensor x = torch::randn({2, 21, 16}), condition = torch::randn({2, 3});
  EXPECT_TRUE(stack.forward(x, condition).requires_grad());
  const torch::NoGradGuard no_grad;
  const auto by = [&](ScanPath path) {
    stack.run_by(path);
    return stack.forward(x, condition);
  };
  const torch::Tensor fused = by(ScanPath::fused), operators = by(ScanPath::operators);
  EXPECT_LT(distance(operators, fused), 1e-4);
  EXPECT_LT(distance(by(ScanPath::plain), fused), 1e-4);
  EXPECT_FALSE(torch::equal(fused, operators)) << "the two paths are meant to be two";
}

TEST(MambaStack, ReadsItsWeightsAtEveryCall) {
  torch::manual_seed(36);
  MambaStack stack({.channels = 16, .d_state = 4, .blocks = 2});
  const torch::NoGradGuard no_grad;
  const torch::Tensor x = torch::randn({1, 12, 16});
  torch::Tensor before = stack.forward(x, {});
  for (const auto& item : stack.named_parameters()) {
    torch::Tensor parameter = item.value();
    // As a swap with running means does: no new tensor, and no version counted.
    float* values = parameter.data_ptr<float>();
    for (std::int64_t i = 0; i < parameter.numel(); ++i) values[i] += 0.25f;
    const torch::Tensor after = stack.forward(x, {});
    EXPECT_FALSE(torch::equal(before, after)) << item.key();
    before = after;
  }
  stack.run_by(ScanPath::operators);
  EXPECT_LT(distance(before, stack.forward(x, {})), 1e-4);
}

TEST(MambaStack, RefusesWhatDoesNotFit) {
  MambaStack stack({.channels = 8, .d_state = 2, .blocks = 2, .condition_dim = 3});
  const torch::NoGradGuard no_grad;
  const torch::Tensor x = torch::zeros({2, 4, 8}), condition = torch::zeros({2, 3});
  EXPECT_NO_THROW(stack.forward(x, condition));
  EXPECT_THROW(stack.forward(torch::zeros({2, 4, 9}), condition), std::invalid_argument);
  EXPECT_THROW(stack.forward(x, {}), std::invalid_argument);
  EXPECT_THROW(stack.forward(x, torch::zeros({1, 3})), std::invalid_argument);
  BackboneState state;
  stack.forward_from(state, x.narrow(0, 0, 1), condition.narrow(0, 0, 1));
  EXPECT_THROW(stack.forward_from(state, x, condition), std::invalid_argument);
  state.resize(1);
  EXPECT_THROW(stack.forward_from(state, x, condition), std::invalid_argument);
}

}  // namespace
}  // namespace flowscope
