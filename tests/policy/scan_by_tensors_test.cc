// The scan for other devices, run on CPU tensors against the loop over tokens.
#include "policy/scan_by_tensors.h"

#include <gtest/gtest.h>

#include "policy/causal_conv.h"
#include "policy/plain_scan.h"

namespace flowscope {
namespace {

ScanArguments leaves(std::int64_t length, bool gate, bool start) {
  torch::manual_seed(length);
  const std::int64_t batch = 2, channels = 5, states = 3;
  const auto leaf = [](const torch::Tensor& t) { return t.detach().requires_grad_(); };
  ScanArguments a{leaf(torch::randn({batch, length, channels})),
                  leaf(torch::softplus(torch::randn({batch, length, channels}))),
                  leaf(-4 * torch::rand({channels, states}) - 0.1),
                  leaf(torch::randn({batch, length, states})),
                  leaf(torch::randn({batch, length, states})),
                  leaf(torch::randn({channels}))};
  if (gate) a.z = leaf(torch::randn({batch, length, channels}));
  if (start) a.h0 = leaf(torch::randn({batch, channels, states}));
  return a;
}

std::vector<torch::Tensor> gradients(const ScanArguments& a, const ScanResult& r) {
  torch::manual_seed(1);
  const torch::Tensor loss =
      (r.y * torch::randn_like(r.y)).sum() + (r.last_state * torch::randn_like(r.last_state)).sum();
  std::vector<torch::Tensor> inputs{a.u, a.delta, a.A, a.B, a.C, a.D};
  if (a.z.defined()) inputs.push_back(a.z);
  if (a.h0.defined()) inputs.push_back(a.h0);
  return torch::autograd::grad({loss}, inputs);
}

TEST(ScanByTensors, IsTheLoopOverTokensInValuesAndGradients) {
  for (const std::int64_t length : {1, 2, 7, 33})
    for (const std::int64_t chunk : {0, 1, 4, 8, 64})
      for (const bool given : {true, false}) {
        const ScanArguments a = leaves(length, given, given);
        const ScanResult fast = scan_by_tensors(a, chunk), slow = plain_scan(a);
        const std::string which = "length " + std::to_string(length) + " chunk " + std::to_string(chunk);
        EXPECT_TRUE(torch::allclose(fast.y, slow.y, 1e-4, 1e-5)) << which;
        EXPECT_TRUE(torch::allclose(fast.last_state, slow.last_state, 1e-4, 1e-5)) << which;
        const auto got = gradients(a, fast), wanted = gradients(a, slow);
        ASSERT_EQ(got.size(), wanted.size());
        for (std::size_t i = 0; i < got.size(); ++i)
          EXPECT_TRUE(torch::allclose(got[i], wanted[i], 1e-3, 1e-4)) << which << " gradient " << i;
      }
}

TEST(ScanByTensors, OneResultAloneCanBeDifferentiated) {
  const ScanArguments a = leaves(9, true, true);
  const auto of_y = [&](const ScanResult& r) { return torch::autograd::grad({r.y.sum()}, {a.delta})[0]; };
  EXPECT_TRUE(torch::allclose(of_y(scan_by_tensors(a, 4)), of_y(plain_scan(a)), 1e-4, 1e-5));
  const auto of_state = [&](const ScanResult& r) {
    return torch::autograd::grad({r.last_state.sum()}, {a.h0})[0];
  };
  EXPECT_TRUE(torch::allclose(of_state(scan_by_tensors(a, 4)), of_state(plain_scan(a)), 1e-4, 1e-5));
}

TEST(ScanByTensors, KeepsStrongDecayFinite) {
  ScanArguments a = leaves(64, false, false);
  a.delta = torch::full_like(a.delta, 50).requires_grad_();
  const ScanResult r = scan_by_tensors(a);
  EXPECT_TRUE(torch::isfinite(r.y).all().item<bool>());
  for (const torch::Tensor& g : gradients(a, r)) EXPECT_TRUE(torch::isfinite(g).all().item<bool>());
}

TEST(ScanByTensors, NamesWhatDoesNotFit) {
  ScanArguments a = leaves(3, false, false);
  a.u = torch::randn({3, 5});
  EXPECT_THROW(scan_by_tensors(a), std::invalid_argument);
}

TEST(CausalConvByTensors, IsTheKernelInValuesAndGradients) {
  torch::manual_seed(3);
  const auto leaf = [](const torch::Tensor& t) { return t.detach().requires_grad_(); };
  const torch::Tensor x = leaf(torch::randn({2, 9, 5})), weight = leaf(torch::randn({4, 5})),
                      bias = leaf(torch::randn({5})), tail = leaf(torch::randn({2, 3, 5}));
  const torch::Tensor factor = torch::randn({2, 9, 5});
  for (const torch::Tensor& before : {tail, torch::Tensor()}) {
    const torch::Tensor fast = causal_conv_silu_by_tensors(x, weight, bias, before),
                        kernel = causal_conv_silu(x, weight, bias, before);
    EXPECT_TRUE(torch::allclose(fast, kernel, 1e-4, 1e-5));
    const auto a = torch::autograd::grad({(fast * factor).sum()}, {x, weight, bias});
    const auto b = torch::autograd::grad({(kernel * factor).sum()}, {x, weight, bias});
    for (std::size_t i = 0; i < a.size(); ++i) EXPECT_TRUE(torch::allclose(a[i], b[i], 1e-3, 1e-4)) << i;
  }
}

}  // namespace
}  // namespace flowscope
