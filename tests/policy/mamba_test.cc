#include "policy/mamba.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "policy/plain_scan.h"

namespace flowscope {
namespace {

using Weights = std::map<std::string, torch::Tensor>;

Weights weights_of(const MambaBlock& block) {
  Weights weights;
  for (const auto& item : block->named_parameters()) weights[item.key()] = item.value();
  return weights;
}

/// The block as its equations, one torch operator after the other.
torch::Tensor reference(const Weights& w, const torch::Tensor& x, const torch::Tensor& condition) {
  const std::int64_t d_model = x.size(2), length = x.size(1), d_state = w.at("A_log").size(1),
                     rank = w.at("dt_proj.weight").size(1), taps = w.at("conv_weight").size(0);
  torch::Tensor normed = torch::layer_norm(x, {d_model}, w.at("norm.weight"), w.at("norm.bias"));
  if (condition.defined()) {
    const auto parts = torch::linear(torch::silu(condition), w.at("adaptive.weight"), w.at("adaptive.bias"))
                           .unsqueeze(1)
                           .chunk(2, 2);
    normed = normed * (1 + parts[0]) + parts[1];
  }
  const auto halves = torch::linear(normed, w.at("in_proj.weight")).chunk(2, 2);
  const torch::Tensor padded = torch::constant_pad_nd(halves[0], {0, 0, taps - 1, 0});
  torch::Tensor sum = w.at("conv_bias");
  for (std::int64_t k = 0; k < taps; ++k) sum = sum + padded.narrow(1, k, length) * w.at("conv_weight")[k];
  const torch::Tensor u = torch::silu(sum);
  const auto parts = torch::linear(u, w.at("x_proj.weight")).split_with_sizes({rank, d_state, d_state}, 2);
  const torch::Tensor delta =
      torch::softplus(torch::linear(parts[0], w.at("dt_proj.weight"), w.at("dt_proj.bias")));
  const torch::Tensor A = -torch::exp(w.at("A_log"));
  const torch::Tensor scanned = plain_scan({u, delta, A, parts[1], parts[2], w.at("D"), halves[1]}).y;
  return x + torch::linear(scanned, w.at("out_proj.weight"));
}

double relative_distance(const torch::Tensor& a, const torch::Tensor& exact) {
  const double scale = std::max(exact.abs().max().item<double>(), 1e-9);
  return (a.to(torch::kFloat64) - exact).abs().max().item<double>() / scale;
}

class MambaBlockForm : public testing::TestWithParam<MambaOptions> {};

TEST_P(MambaBlockForm, EqualsItsEquationsInValuesAndGradients) {
  torch::manual_seed(21);
  const MambaOptions options = GetParam();
  MambaBlock block(options);
  {
    const torch::NoGradGuard no_grad;  // off the zero start, so that every path carries a gradient
    for (auto& parameter : block->parameters()) parameter.add_(0.1 * torch::randn_like(parameter));
  }
  torch::Tensor x = torch::randn({2, 13, options.d_model}).requires_grad_();
  torch::Tensor condition;
  if (options.condition_dim > 0) condition = torch::randn({2, options.condition_dim}).requires_grad_();
  const auto in_double = [](const torch::Tensor& t) {
    return t.detach().to(torch::kFloat64).requires_grad_();
  };
  Weights exact_weights;
  for (const auto& [name, weight] : weights_of(block)) exact_weights[name] = in_double(weight);
  const torch::Tensor exact_x = in_double(x);
  const torch::Tensor exact_condition = condition.defined() ? in_double(condition) : condition;

  const torch::Tensor y = block->forward(x, condition),
                      exact_y = reference(exact_weights, exact_x, exact_condition);
  EXPECT_LT(relative_distance(y, exact_y), 1e-5);
  const torch::Tensor factor = torch::randn_like(x);
  (y * factor).sum().backward();
  (exact_y * factor).sum().backward();
  EXPECT_LT(relative_distance(x.grad(), exact_x.grad()), 1e-4);
  if (condition.defined()) {
    EXPECT_LT(relative_distance(condition.grad(), exact_condition.grad()), 1e-4);
  }
  for (const auto& [name, weight] : weights_of(block)) {
    ASSERT_TRUE(weight.grad().defined()) << name;
    EXPECT_GT(weight.grad().abs().max().item<double>(), 0) << name;
    EXPECT_LT(relative_distance(weight.grad(), exact_weights[name].grad()), 1e-4) << name;
  }
}

INSTANTIATE_TEST_SUITE_P(Forms, MambaBlockForm,
                         testing::Values(MambaOptions{.d_model = 24, .d_state = 16},
                                         MambaOptions{.d_model = 20, .d_state = 5, .condition_dim = 7},
                                         MambaOptions{.d_model = 8, .d_state = 8, .d_conv = 2, .expand = 3}));

TEST(MambaBlock, IsCausal) {
  torch::manual_seed(1);
  MambaBlock block(MambaOptions{.d_model = 24, .d_state = 4});
  const torch::NoGradGuard no_grad;
  torch::Tensor x = torch::randn({2, 9, 24});
  const torch::Tensor before = block->forward(x);
  x.select(1, 5).add_(torch::randn({2, 24}));
  const torch::Tensor after = block->forward(x);
  EXPECT_TRUE(torch::equal(before.narrow(1, 0, 5), after.narrow(1, 0, 5)));
  EXPECT_GT((before.select(1, 8) - after.select(1, 8)).abs().max().item<float>(), 1e-7);
}

TEST(MambaBlock, RunsOnFromAStoredPrefix) {
  torch::manual_seed(6);
  MambaBlock block(MambaOptions{.d_model = 24, .d_state = 8, .condition_dim = 5});
  const torch::NoGradGuard no_grad;
  const torch::Tensor x = torch::randn({3, 40, 24}), condition = torch::randn({3, 5});
  const torch::Tensor whole = block->forward(x, condition);
  for (const std::int64_t prefix : {1, 2, 17, 38}) {
    MambaState after_prefix;
    const torch::Tensor head = block->forward_from(after_prefix, x.narrow(1, 0, prefix), condition);
    for (int repeat = 0; repeat < 2; ++repeat) {
      MambaState state = after_prefix;
      const torch::Tensor tail = block->forward_from(state, x.narrow(1, prefix, 40 - prefix), condition);
      EXPECT_TRUE(torch::allclose(torch::cat({head, tail}, 1), whole, 1e-5, 1e-6)) << "prefix " << prefix;
    }
  }
}

TEST(MambaBlock, IsDifferentiableAcrossACut) {
  torch::manual_seed(16);
  MambaBlock block(MambaOptions{.d_model = 16, .d_state = 4, .condition_dim = 3});
  const torch::Tensor condition = torch::randn({2, 3}), factor = torch::randn({2, 20, 16});
  const auto gradients = [&](auto run) {
    torch::manual_seed(5);
    const torch::Tensor x = torch::randn({2, 20, 16}).requires_grad_();
    block->zero_grad();
    (run(x) * factor).sum().backward();
    std::vector<torch::Tensor> found{x.grad()};
    for (const auto& parameter : block->parameters()) found.push_back(parameter.grad().clone());
    return found;
  };
  const auto whole = gradients([&](const torch::Tensor& x) { return block->forward(x, condition); });
  for (const std::int64_t cut : {1, 2, 3, 11, 19}) {
    const auto parts = gradients([&](const torch::Tensor& x) {
      MambaState state;
      const torch::Tensor head = block->forward_from(state, x.narrow(1, 0, cut), condition);
      return torch::cat({head, block->forward_from(state, x.narrow(1, cut, 20 - cut), condition)}, 1);
    });
    for (std::size_t i = 0; i < whole.size(); ++i) {
      EXPECT_LT(relative_distance(parts[i], whole[i].to(torch::kFloat64)), 1e-5) << i << ", cut at " << cut;
    }
  }
}

TEST(MambaBlock, StartsAsPublished) {
  torch::manual_seed(2);
  MambaBlock block(MambaOptions{.d_model = 40, .d_state = 6, .condition_dim = 3});
  const Weights w = weights_of(block);
  EXPECT_EQ(w.at("dt_proj.weight").sizes(), (std::vector<std::int64_t>{80, 3}));
  EXPECT_EQ(w.at("x_proj.weight").sizes(), (std::vector<std::int64_t>{3 + 12, 80}));
  const torch::Tensor step = torch::softplus(w.at("dt_proj.bias"));
  EXPECT_GT(step.min().item<double>(), 0.99e-3);
  EXPECT_LT(step.max().item<double>(), 1.01e-1);
  EXPECT_LT(step.min().item<double>(), 5e-3) << "log-uniform reaches the small steps";
  for (int n = 0; n < 6; ++n) EXPECT_FLOAT_EQ(w.at("A_log")[11][n].item<float>(), std::log(n + 1.f));
  EXPECT_TRUE(torch::equal(w.at("D"), torch::ones({80})));
  EXPECT_TRUE(torch::equal(w.at("adaptive.weight"), torch::zeros({80, 3})));
  EXPECT_EQ(w.count("in_proj.bias") + w.count("x_proj.bias") + w.count("out_proj.bias"), 0u);
  // norm 2, adaptive bias, conv bias, dt bias, A_log, D
  EXPECT_EQ(block->parameters_without_decay().size(), 7u);
}

TEST(MambaBlock, RefusesWhatDoesNotFit) {
  MambaBlock plain(MambaOptions{.d_model = 8, .d_state = 2});
  MambaBlock conditioned(MambaOptions{.d_model = 8, .d_state = 2, .condition_dim = 3});
  const torch::Tensor x = torch::zeros({1, 2, 8});
  EXPECT_THROW(plain->forward(torch::zeros({1, 2, 9})), std::invalid_argument);
  EXPECT_THROW(plain->forward(x, torch::zeros({1, 3})), std::invalid_argument);
  EXPECT_THROW(conditioned->forward(x), std::invalid_argument);
  EXPECT_THROW(MambaBlock(MambaOptions{.d_model = 0}), std::invalid_argument);
}

}  // namespace
}  // namespace flowscope
