// The transformer: its attention against a plain one, what sees what, its size, and its gradients.
#include "policy/transformer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <stdexcept>

#include "policy/attention.h"
#include "policy/mamba.h"

namespace flowscope {
namespace {

torch::Tensor random(std::vector<std::int64_t> shape, int seed) {
  torch::manual_seed(seed);
  return torch::randn(shape);
}

double worst(const torch::Tensor& a, const torch::Tensor& b) { return (a - b).abs().max().item<double>(); }

/// One query at a time, in double.
torch::Tensor attention_by_definition(const torch::Tensor& q, const torch::Tensor& k,
                                      const torch::Tensor& v) {
  std::vector<torch::Tensor> rows;
  for (std::int64_t i = 0; i < q.size(2); ++i) {
    const torch::Tensor score =
        (q.narrow(2, i, 1) * k).sum(-1, true) / std::sqrt(static_cast<double>(q.size(3)));
    const torch::Tensor e = torch::exp(score - score.amax(2, true));
    rows.push_back((e * v).sum(2, true) / e.sum(2, true));
  }
  return torch::cat(rows, 2);
}

TEST(Attention, IsTheDefinitionInValuesAndGradientsForEveryBlocking) {
  for (const std::int64_t block : {1, 2 * 3 * 7 * 2, 1 << 20}) {  // one row, two rows, all at once
    torch::Tensor given[3], plain[3];
    for (int i = 0; i < 3; ++i) {
      given[i] = random({2, 3, i == 0 ? 5 : 7, 4}, i).requires_grad_();
      plain[i] = given[i].detach().to(torch::kFloat64).requires_grad_();
    }
    const torch::Tensor pull = random({2, 3, 5, 4}, 9);
    const torch::Tensor out = attention(given[0], given[1], given[2], block);
    const torch::Tensor expected = attention_by_definition(plain[0], plain[1], plain[2]);
    EXPECT_LT(worst(out, expected), 1e-6) << block;
    (out * pull).sum().backward();
    (expected * pull).sum().backward();
    for (int i = 0; i < 3; ++i)
      EXPECT_LT(worst(given[i].grad(), plain[i].grad()), 1e-5) << block << ", " << i;
  }
}

TEST(Attention, RefusesShapesThatDoNotFit) {
  const torch::Tensor q = random({1, 2, 3, 4}, 0);
  EXPECT_THROW(attention(q, random({1, 2, 5, 3}, 0), random({1, 2, 5, 3}, 0)), std::invalid_argument);
  EXPECT_THROW(attention(q, q, random({1, 2, 5, 4}, 0)), std::invalid_argument);
  EXPECT_THROW(attention(q, q.narrow(2, 0, 0), q.narrow(2, 0, 0)), std::invalid_argument);
}

Backbone make(int condition_dim = 0, int blocks = 2) {
  torch::manual_seed(4);
  return make_backbone("transformer",
                       {.channels = 16, .d_state = 4, .blocks = blocks, .condition_dim = condition_dim});
}

TEST(Transformer, TokensOfOneCallSeeEachOtherAndAPrefixStandsByItself) {
  const torch::NoGradGuard no_grad;
  const Backbone stack = make();
  const torch::Tensor x = random({2, 6, 16}, 1);
  torch::Tensor last_changed = x.clone();
  last_changed.narrow(1, 5, 1).copy_(random({2, 1, 16}, 8));
  EXPECT_GT(worst(stack->forward(x).select(1, 0), stack->forward(last_changed).select(1, 0)), 1e-4);

  BackboneState state;
  const torch::Tensor prefix = stack->forward_from(state, x.narrow(1, 0, 4));
  EXPECT_LT(worst(prefix, stack->forward(x.narrow(1, 0, 4))), 1e-6);
  const BackboneState remembered = state;
  const torch::Tensor rest = stack->forward_from(state, x.narrow(1, 4, 2));
  EXPECT_GT(worst(rest, stack->forward(x.narrow(1, 4, 2))), 1e-4) << "the prefix counts";

  BackboneState again = remembered;
  EXPECT_TRUE(torch::equal(rest, stack->forward_from(again, x.narrow(1, 4, 2))))
      << "a state may be run on twice";
  EXPECT_EQ(remembered[0].first.size(2), 4);
  EXPECT_EQ(state[0].first.size(2), 6);

  // Draws of one scene run on from one state.
  BackboneState twice = repeat_rows(remembered, 2);
  const torch::Tensor draws = x.narrow(1, 4, 2).repeat_interleave(2, 0);
  EXPECT_LT(worst(stack->forward_from(twice, draws), rest.repeat_interleave(2, 0)), 1e-6);
}

TEST(Transformer, TokenByTokenABlockIsTheCausalOne) {
  const torch::NoGradGuard no_grad;
  const Backbone block = make(0, 1);
  const torch::Tensor x = random({2, 5, 16}, 2);
  BackboneState state;
  for (std::int64_t i = 0; i < 5; ++i) {
    const torch::Tensor y = block->forward_from(state, x.narrow(1, i, 1));
    EXPECT_LT(worst(y, block->forward(x.narrow(1, 0, i + 1)).narrow(1, i, 1)), 1e-6) << i;
  }
}

TEST(Transformer, ConditionChangesNothingUntilLearntAndThenEverything) {
  const torch::NoGradGuard no_grad;
  const Backbone stack = make(6);
  const torch::Tensor x = random({2, 5, 16}, 3), c = random({2, 6}, 4);
  EXPECT_TRUE(torch::equal(stack->forward(x, c), stack->forward(x, torch::zeros_like(c))));
  for (auto& item : stack->named_parameters())
    if (item.key().find("adaptive.weight") != std::string::npos) item.value().fill_(0.1);
  EXPECT_GT(worst(stack->forward(x, c), stack->forward(x, torch::zeros_like(c))), 1e-3);
  EXPECT_THROW(stack->forward(x), std::invalid_argument);
  EXPECT_THROW(make()->forward(x, c), std::invalid_argument);
  EXPECT_THROW(make()->forward(random({2, 5, 8}, 0)), std::invalid_argument);
  EXPECT_THROW(make_backbone("lstm", {}), std::invalid_argument);
}

std::int64_t parameters_of(const torch::nn::Module& module) {
  std::int64_t count = 0;
  for (const auto& p : module.parameters()) count += p.numel();
  return count;
}

TEST(Transformer, ABlockIsAsLargeAsAMambaBlock) {
  for (const auto& [channels, d_state] : {std::pair{120, 16}, std::pair{64, 8}, std::pair{32, 4}}) {
    const BackboneOptions options{.channels = channels, .d_state = d_state, .blocks = 1, .condition_dim = 0};
    const auto mamba = static_cast<double>(parameters_of(*make_backbone("mamba", options)));
    const auto transformer = static_cast<double>(parameters_of(*make_backbone("transformer", options)));
    EXPECT_NEAR(transformer / mamba, 1, 0.06) << channels << " channels";
  }
}

/// Gradient of `loss` in the direction of the change of one tensor, by central differences.
double slope(torch::Tensor tensor, const torch::Tensor& direction,
             const std::function<torch::Tensor()>& loss) {
  const torch::NoGradGuard no_grad;
  const double h = 1e-5;
  tensor.add_(direction, h);
  const double up = loss().item<double>();
  tensor.add_(direction, -2 * h);
  const double down = loss().item<double>();
  tensor.add_(direction, h);
  return (up - down) / (2 * h);
}

TEST(Transformer, GradientsAreTheSlopesInBothForms) {
  const Backbone stack = make(6);
  stack->to(torch::kFloat64);
  {
    const torch::NoGradGuard no_grad;  // away from the zero initialisation, where half the gradients vanish
    for (auto& item : stack->named_parameters())
      if (item.key().find("adaptive") != std::string::npos) item.value().uniform_(-0.2, 0.2);
  }
  torch::Tensor x = random({2, 5, 16}, 5).to(torch::kFloat64).requires_grad_();
  torch::Tensor c = random({2, 6}, 6).to(torch::kFloat64).requires_grad_();
  const torch::Tensor pull = random({2, 2, 16}, 7).to(torch::kFloat64);
  const auto whole = [&] { return (stack->forward(x, c).narrow(1, 3, 2) * pull).sum(); };
  const auto resumed = [&] {
    BackboneState state;
    stack->forward_from(state, x.narrow(1, 0, 3), c);
    return (stack->forward_from(state, x.narrow(1, 3, 2), c) * pull).sum();
  };
  for (const auto& loss : {std::function<torch::Tensor()>(whole), std::function<torch::Tensor()>(resumed)}) {
    stack->zero_grad();
    x.mutable_grad() = c.mutable_grad() = torch::Tensor();
    loss().backward();
    std::vector<torch::Tensor> tensors = stack->parameters();
    tensors.push_back(x);
    tensors.push_back(c);
    int seed = 20;
    for (const torch::Tensor& tensor : tensors) {
      const torch::Tensor direction = random(tensor.sizes().vec(), seed++).to(torch::kFloat64);
      const double by_differences = slope(tensor.detach(), direction, loss);
      // The last feed-forward does not reach back into the prefix, but the state does: no gradient is
      // missing.
      ASSERT_TRUE(tensor.grad().defined()) << "no gradient is missing, through the state neither";
      EXPECT_NEAR((tensor.grad() * direction).sum().item<double>(), by_differences,
                  1e-6 * (1 + std::abs(by_differences)));
    }
  }
}

}  // namespace
}  // namespace flowscope
