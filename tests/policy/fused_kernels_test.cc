#include <gtest/gtest.h>

#include <tuple>

#include "policy/mamba_kernels.h"
#include "policy/torch_parts.h"

namespace flowscope {
namespace {

double relative_distance(const torch::Tensor& a, const torch::Tensor& exact) {
  const double scale = std::max(exact.abs().max().item<double>(), 1e-12);
  return (a.to(torch::kFloat64) - exact).abs().max().item<double>() / scale;
}

class FusedProduct : public testing::TestWithParam<std::tuple<int, int, int, bool>> {};

TEST_P(FusedProduct, EqualsTheMatrixProductOnEveryInstructionSet) {
  torch::manual_seed(3);
  const auto [rows, inputs, outputs, add] = GetParam();
  const torch::Tensor weight = torch::randn({outputs, inputs}), wide = torch::randn({rows, inputs + 5});
  const torch::Tensor start = torch::randn({rows, outputs + 3});
  const torch::Tensor x = wide.narrow(1, 2, inputs);
  torch::Tensor exact = x.to(torch::kFloat64).mm(weight.to(torch::kFloat64).t());
  if (add) exact = exact + start.narrow(1, 0, outputs);
  for (const MambaKernels* kernels : supported_mamba_kernels()) {
    SCOPED_TRACE(kernels->name);
    const torch::Tensor packed = torch::empty({kernels->packed_floats(inputs, outputs)}), y = start.clone();
    kernels->pack(weight.data_ptr<float>(), inputs, outputs, packed.data_ptr<float>());
    kernels->multiply({rows,
                       inputs,
                       outputs,
                       {x.data_ptr<float>(), inputs + 5},
                       packed.data_ptr<float>(),
                       y.data_ptr<float>(),
                       outputs + 3,
                       add});
    EXPECT_LT(relative_distance(y.narrow(1, 0, outputs), exact), 1e-5);
    EXPECT_TRUE(torch::equal(y.narrow(1, outputs, 3), start.narrow(1, outputs, 3)))
        << "wrote past its columns";
  }
}

INSTANTIATE_TEST_SUITE_P(Shapes, FusedProduct,
                         testing::Combine(testing::Values(1, 2, 7, 19), testing::Values(1, 8, 33),
                                          testing::Values(1, 4, 17, 40, 48, 101), testing::Bool()));

TEST(FusedNorm, EqualsTorchsLayerNormOnEveryInstructionSet) {
  torch::manual_seed(5);
  for (const std::int64_t channels : {1, 3, 16, 24, 33, 120}) {
    const torch::Tensor x = 3 * torch::randn({7, channels}) + 5, gain = torch::randn({channels}),
                        offset = torch::randn({channels});
    const auto exact = torch::layer_norm(x.to(torch::kFloat64), {channels}, gain.to(torch::kFloat64),
                                         offset.to(torch::kFloat64), 1e-5);
    for (const MambaKernels* kernels : supported_mamba_kernels()) {
      const torch::Tensor y = x.clone();
      kernels->layer_norm({7, channels, y.data_ptr<float>(), gain.data_ptr<float>(), offset.data_ptr<float>(),
                           1e-5f, y.data_ptr<float>()});
      EXPECT_LT(relative_distance(y, exact), 1e-5) << kernels->name << ", " << channels << " channels";
    }
  }
}

TEST(FusedSoftplus, IsRelativelyExactFromTheSmallestStepToTheLargest) {
  const torch::Tensor x = torch::linspace(-80, 80, 1601).reshape({1, 1601}),
                      bias = torch::full({1601}, 0.25f);
  const torch::Tensor exact = torch::log1p(torch::exp(-(x + bias).to(torch::kFloat64).abs())) +
                              (x + bias).to(torch::kFloat64).clamp_min(0);
  for (const MambaKernels* kernels : supported_mamba_kernels()) {
    const torch::Tensor y = x.clone();
    kernels->softplus(y.data_ptr<float>(), bias.data_ptr<float>(), 1, 1601);
    // e^x of a large x amplifies the rounding of x * log2(e).
    EXPECT_LT(((y - exact) / exact).abs().max().item<double>(), 1e-5) << kernels->name;
    torch::Tensor broken = torch::full({1, 3}, std::numeric_limits<float>::quiet_NaN());
    kernels->softplus(broken.data_ptr<float>(), bias.data_ptr<float>(), 1, 3);
    EXPECT_TRUE(torch::isnan(broken).all().item<bool>()) << kernels->name;
  }
}

}  // namespace
}  // namespace flowscope
