// The optimiser: clipping, decay, the running mean, and what a number that is not finite may do to it.
#include "policy/adamw.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace flowscope {
namespace {

struct TwoWeights : torch::nn::Module {
  TwoWeights() {
    torch::manual_seed(2);
    matrix = register_parameter("matrix", torch::randn({3, 4}));
    bias = register_parameter("bias", torch::randn({5}));
    A_log = register_parameter("A_log", torch::randn({2, 3}));
  }
  void set_gradients(double scale) {
    torch::manual_seed(7);
    for (torch::Tensor w : parameters()) w.mutable_grad() = scale * torch::randn_like(w).detach();
  }
  torch::Tensor matrix, bias, A_log;
};

std::vector<torch::Tensor> copies(const std::vector<torch::Tensor>& tensors) {
  std::vector<torch::Tensor> out;
  for (const torch::Tensor& t : tensors) out.push_back(t.detach().clone());
  return out;
}
std::vector<torch::Tensor> state_of(const AdamW& optimizer) {
  std::vector<torch::Tensor> out;
  for (const auto& [name, tensor] : optimizer.state()) out.push_back(tensor.clone());
  return out;
}
bool same_bits(const std::vector<torch::Tensor>& a, const std::vector<torch::Tensor>& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i)
    if (!torch::equal(a[i], b[i])) return false;
  return true;
}

TEST(AdamW, IsWhatThePublicationSays) {
  TwoWeights module;
  const AdamWOptions o{.weight_decay = 0.1, .clip = 1e9};
  AdamW optimizer(module, o);
  const torch::Tensor w0 = module.matrix.detach().clone();
  module.set_gradients(0.5);
  const torch::Tensor g = module.matrix.grad().clone();
  optimizer.step(0.01);
  // First step: the corrected moments are the gradient and its square.
  const torch::Tensor wanted = w0 * (1 - 0.01 * 0.1) - 0.01 * g / (g.abs() + o.epsilon);
  EXPECT_TRUE(torch::allclose(module.matrix.detach(), wanted, 1e-5, 1e-6));
}

TEST(AdamW, OnePassIsTheSameAsTensorOperations) {
  TwoWeights a, b;
  const AdamWOptions fused{.weight_decay = 0.1, .clip = 0.5};
  AdamWOptions plain = fused;
  plain.fused = false;
  AdamW fast(a, fused), slow(b, plain);
  for (int i = 0; i < 5; ++i) {
    a.set_gradients(1 + i);
    b.set_gradients(1 + i);
    EXPECT_NEAR(fast.step(0.01), slow.step(0.01), 1e-5);
  }
  for (std::size_t i = 0; i < a.parameters().size(); ++i)
    EXPECT_TRUE(torch::allclose(a.parameters()[i], b.parameters()[i], 1e-5, 1e-6)) << i;
  const auto x = state_of(fast), y = state_of(slow);
  for (std::size_t i = 0; i < x.size(); ++i) EXPECT_TRUE(torch::allclose(x[i], y[i], 1e-5, 1e-7)) << i;
}

TEST(AdamW, ClipsTheNormOfAllGradientsTogether) {
  TwoWeights large, small;
  const AdamWOptions o{.clip = 1};
  AdamW a(large, o), b(small, o);
  small.set_gradients(0.01);
  const double norm = b.step(0.01);
  ASSERT_LT(norm, 1);
  large.set_gradients(0.01 / norm);  // norm 1: not clipped
  EXPECT_NEAR(a.step(0.01), 1, 1e-5);
  const torch::Tensor wanted = a.state().at("m/matrix").clone();
  TwoWeights larger;
  AdamW c(larger, o);
  larger.set_gradients(25);
  EXPECT_NEAR(c.step(0.01), 25 / (0.01 / norm), 1e-2);
  EXPECT_TRUE(torch::allclose(c.state().at("m/matrix"), wanted, 1e-4, 1e-7));
}

TEST(AdamW, OnlyMatricesDecay) {
  TwoWeights module;
  AdamW optimizer(module, {.weight_decay = 0.5});
  const auto before = copies({module.matrix, module.bias, module.A_log});
  module.set_gradients(0);
  optimizer.step(0.1);
  EXPECT_TRUE(torch::allclose(module.matrix, before[0] * 0.95));
  EXPECT_TRUE(torch::equal(module.bias, before[1]));
  EXPECT_TRUE(torch::equal(module.A_log, before[2]));
}

TEST(AdamW, TheRunningMeanForgetsTheFirstWeightsEarly) {
  TwoWeights module;
  AdamW optimizer(module, {.ema = 0.999});
  torch::Tensor wanted = module.bias.detach().clone();
  for (int n = 1; n <= 30; ++n) {
    module.set_gradients(1);
    optimizer.step(0.05);
    const double keep = (1.0 + n) / (10.0 + n);
    wanted = keep * wanted + (1 - keep) * module.bias.detach();
    ASSERT_TRUE(torch::allclose(optimizer.state().at("mean/bias"), wanted, 1e-5, 1e-6)) << n;
  }
  optimizer.steps = 1000000;  // later the factor is the given one
  const torch::Tensor mean = optimizer.state().at("mean/bias").clone();
  module.set_gradients(1);
  optimizer.step(0.05);
  EXPECT_TRUE(torch::allclose(optimizer.state().at("mean/bias"), 0.999 * mean + 0.001 * module.bias.detach(),
                              1e-5, 1e-6));
}

TEST(AdamW, APoisonedGradientChangesNotOneBit) {
  for (const float poison : {std::nanf(""), std::numeric_limits<float>::infinity()}) {
    TwoWeights module;
    AdamW optimizer(module, {});
    module.set_gradients(1);
    optimizer.step(0.01);
    const auto weights = copies(module.parameters()), state = state_of(optimizer);
    module.set_gradients(1);
    module.bias.mutable_grad()[3] = poison;
    EXPECT_FALSE(std::isfinite(optimizer.step(0.01)));
    EXPECT_TRUE(same_bits(weights, copies(module.parameters())));
    EXPECT_TRUE(same_bits(state, state_of(optimizer)));
    EXPECT_EQ(optimizer.steps, 1);
    EXPECT_FALSE(module.bias.grad().defined()) << "the poison must not meet the next step";
  }
}

TEST(AdamW, SwapsWeightsAndMeanAndBack) {
  TwoWeights module;
  AdamW optimizer(module, {});
  module.set_gradients(1);
  optimizer.step(0.1);
  const auto weights = copies(module.parameters());
  const torch::Tensor mean = optimizer.state().at("mean/matrix").clone();
  optimizer.swap_mean();
  EXPECT_TRUE(torch::equal(module.matrix, mean));
  EXPECT_FALSE(torch::equal(module.matrix, weights[0]));
  optimizer.swap_mean();
  EXPECT_TRUE(same_bits(weights, copies(module.parameters())));
}

TEST(AdamW, GradientsGoOutAndInFlat) {
  TwoWeights module;
  AdamW optimizer(module, {});
  module.set_gradients(1);
  module.A_log.mutable_grad().reset();
  std::vector<float> flat = optimizer.gradients();
  ASSERT_EQ(flat.size(), 23u);
  EXPECT_EQ(flat[13], module.bias.grad()[1].item<float>());
  EXPECT_EQ(flat[22], 0);
  for (float& g : flat) g *= 2;
  const torch::Tensor wanted = module.matrix.grad() * 2;
  optimizer.set_gradients(flat);
  EXPECT_TRUE(torch::equal(module.matrix.grad(), wanted));
  EXPECT_FALSE(module.A_log.grad().defined());
  flat.pop_back();
  EXPECT_THROW(optimizer.set_gradients(flat), std::invalid_argument);
}

}  // namespace
}  // namespace flowscope
