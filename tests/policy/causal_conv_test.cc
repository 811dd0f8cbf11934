#include "policy/causal_conv.h"

#include <gtest/gtest.h>

#include "policy/mamba_kernels.h"

namespace flowscope {
namespace {

/// The definition, one tap at a time, in the type of its arguments.
torch::Tensor reference(const torch::Tensor& x, const torch::Tensor& weight, const torch::Tensor& bias,
                        const torch::Tensor& tail) {
  const std::int64_t taps = weight.size(0), length = x.size(1);
  const torch::Tensor padded =
      tail.defined() ? torch::cat({tail, x}, 1) : torch::constant_pad_nd(x, {0, 0, taps - 1, 0});
  torch::Tensor sum = bias;
  for (std::int64_t k = 0; k < taps; ++k) sum = sum + padded.narrow(1, k, length) * weight[k];
  return torch::silu(sum);
}

struct Case {
  std::int64_t batch, length, channels, taps;
  bool tail = false;
};
class CausalConv : public testing::TestWithParam<Case> {};

TEST_P(CausalConv, EqualsItsDefinitionInValuesAndGradients) {
  torch::manual_seed(9);
  const Case& c = GetParam();
  const torch::Tensor wide = torch::randn({c.batch, c.length, 2 * c.channels});
  const torch::Tensor weight = torch::randn({c.taps, c.channels}), bias = torch::randn({c.channels});
  const torch::Tensor factor = torch::randn({c.batch, c.length, c.channels});
  const torch::Tensor tail = torch::randn({c.batch, c.taps - 1, c.channels});
  for (const MambaKernels* kernels : supported_mamba_kernels()) {
    SCOPED_TRACE(kernels->name);
    std::vector<torch::Tensor> fused{wide.clone(), weight.clone(), bias.clone()}, exact;
    if (c.tail) fused.push_back(tail.clone());
    for (auto& tensor : fused) {
      exact.push_back(tensor.to(torch::kFloat64).requires_grad_());
      tensor.requires_grad_();
    }
    const auto columns = [&](const torch::Tensor& t) { return t.narrow(2, c.channels, c.channels); };
    const torch::Tensor y = causal_conv_silu_on(*kernels, columns(fused[0]), fused[1], fused[2],
                                                c.tail ? fused[3] : torch::Tensor());
    const torch::Tensor y_exact =
        reference(columns(exact[0]), exact[1], exact[2], c.tail ? exact[3] : torch::Tensor());
    EXPECT_TRUE(torch::allclose(y.to(torch::kFloat64), y_exact, 1e-5, 1e-5));
    (y * factor).sum().backward();
    (y_exact * factor).sum().backward();
    for (std::size_t i = 0; i < fused.size(); ++i) {
      EXPECT_TRUE(torch::allclose(fused[i].grad().to(torch::kFloat64), exact[i].grad(), 1e-4, 1e-4)) << i;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Shapes, CausalConv,
                         testing::Values(Case{1, 1, 1, 4}, Case{2, 3, 17, 4}, Case{3, 20, 32, 4},
                                         Case{2, 9, 5, 1}, Case{1, 2, 16, 8}, Case{2, 30, 31, 3},
                                         Case{1, 1, 1, 4, true}, Case{3, 20, 33, 4, true},
                                         Case{2, 2, 16, 8, true}, Case{2, 9, 5, 1, true}));

TEST(CausalConvOperator, NamesWhatDoesNotFit) {
  const torch::Tensor x = torch::zeros({1, 4, 6});
  EXPECT_THROW(causal_conv_silu(x, torch::zeros({9, 6}), torch::zeros({6})), std::invalid_argument);
  EXPECT_THROW(causal_conv_silu(x, torch::zeros({4, 5}), torch::zeros({6})), std::invalid_argument);
  EXPECT_THROW(causal_conv_silu(x, torch::zeros({4, 6}), torch::zeros({1})), std::invalid_argument);
  EXPECT_THROW(causal_conv_silu(x, torch::zeros({4, 6}), torch::zeros({6}), torch::zeros({1, 4, 6})),
               std::invalid_argument);
}

}  // namespace
}  // namespace flowscope
