#include "policy/pointwise.h"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "policy/token_kernels.h"

namespace flowscope {
namespace {

torch::Tensor many_numbers() { return torch::linspace(-12, 12, 4801).reshape({4801}); }

double farthest(const torch::Tensor& a, const torch::Tensor& exact) {
  return (a.to(torch::kFloat64) - exact).abs().max().item<double>();
}

struct Exact {
  torch::Tensor x = many_numbers().to(torch::kFloat64);
  torch::Tensor normal = 0.5 * torch::erfc(-x / std::numbers::sqrt2);
  torch::Tensor gelu = x * normal, softplus = torch::log1p(torch::exp(-x.abs())) + x.clamp_min(0);
  torch::Tensor gelu_slope = normal + x * torch::exp(-0.5 * x * x) / std::sqrt(2 * std::numbers::pi);
  torch::Tensor softplus_slope = torch::sigmoid(x);
};

TEST(Pointwise, EqualsTheDefinitionsOnEveryInstructionSet) {
  const Exact exact;
  const torch::Tensor x = many_numbers(), above = torch::full_like(x, 2);
  const auto run = [&](auto function) {
    const torch::Tensor y = torch::empty_like(x);
    function(x.data_ptr<float>(), y.data_ptr<float>(), x.numel());
    return y;
  };
  for (const TokenKernels* kernels : supported_token_kernels()) {
    SCOPED_TRACE(kernels->name);
    const auto slope = [&](auto function) {
      return [&, function](const float* from, float* to, std::int64_t count) {
        function(from, above.data_ptr<float>(), to, count);
      };
    };
    EXPECT_LT(farthest(run(kernels->gelu_of), exact.gelu), 5e-6);
    EXPECT_LT(farthest(run(kernels->softplus_of), exact.softplus), 5e-6);
    EXPECT_LT(farthest(run(slope(kernels->gelu_gradient)), 2 * exact.gelu_slope), 5e-6);
    EXPECT_LT(farthest(run(slope(kernels->softplus_gradient)), 2 * exact.softplus_slope), 2e-6);
  }
}

TEST(Pointwise, HasTheGradientsOfTorchsOwn) {
  torch::manual_seed(4);
  for (const auto& [ours, torchs] :
       {std::pair{&gelu_of, +[](const torch::Tensor& t) { return torch::gelu(t); }},
        std::pair{&softplus_of, +[](const torch::Tensor& t) { return torch::softplus(t); }}}) {
    const torch::Tensor base = 3 * torch::randn({37, 5, 11}), weight = torch::randn({11, 5, 37});
    const auto gradient = [&](const auto& function) {
      const torch::Tensor x = base.clone().requires_grad_();
      (function(x.transpose(0, 2)) * weight).sum().backward();  // not in the order of its memory
      return x.grad();
    };
    EXPECT_LT((ours(base) - torchs(base)).abs().max().item<double>(), 3e-6);
    EXPECT_LT((gradient(ours) - gradient(torchs)).abs().max().item<double>(), 1e-5);
  }
}

TEST(Pointwise, LetsWhatIsNoNumberThrough) {
  const torch::Tensor x = torch::full({21}, std::numeric_limits<float>::quiet_NaN());
  for (const auto function : {&gelu_of, &softplus_of}) {
    const torch::Tensor in = x.clone().requires_grad_(), y = function(in);
    y.sum().backward();
    EXPECT_TRUE(torch::isnan(y).all().item<bool>());
    EXPECT_TRUE(torch::isnan(in.grad()).all().item<bool>());
  }
  EXPECT_EQ(gelu_of(torch::empty({0, 3})).numel(), 0);
}

TEST(Pointwise, RefusesASecondDerivative) {
  const torch::Tensor x = torch::ones({3}).requires_grad_();
  EXPECT_THROW(torch::autograd::grad({gelu_of(x).sum()}, {x}, {}, true, true), std::logic_error);
}

}  // namespace
}  // namespace flowscope
