#include "policy/selective_scan.h"

#include <gtest/gtest.h>

#include "policy/mamba_kernels.h"
#include "policy/plain_scan.h"

namespace flowscope {
namespace {

struct Case {
  std::int64_t batch, length, channels, states;
  bool gate, start;
};

void PrintTo(const Case& c, std::ostream* out) {
  *out << "batch " << c.batch << " length " << c.length << " channels " << c.channels << " states "
       << c.states << (c.gate ? " gate" : "") << (c.start ? " h0" : "");
}

ScanArguments random_arguments(const Case& c) {
  ScanArguments a;
  a.u = torch::randn({c.batch, c.length, c.channels});
  a.delta = torch::softplus(torch::randn({c.batch, c.length, c.channels}) - 1.0);
  a.A = -torch::exp(torch::randn({c.channels, c.states}));
  a.B = torch::randn({c.batch, c.length, c.states});
  a.C = torch::randn({c.batch, c.length, c.states});
  a.D = torch::randn({c.channels});
  if (c.gate) a.z = torch::randn({c.batch, c.length, c.channels});
  if (c.start) a.h0 = torch::randn({c.batch, c.channels, c.states});
  return a;
}

std::vector<torch::Tensor*> differentiated(ScanArguments& a) {
  std::vector<torch::Tensor*> list{&a.u, &a.delta, &a.A, &a.B, &a.C, &a.D};
  if (a.z.defined()) list.push_back(&a.z);
  if (a.h0.defined()) list.push_back(&a.h0);
  return list;
}

/// Of the list above.
const char* name_of(const ScanArguments& a, std::size_t i) {
  static const char* const names[] = {"u", "delta", "A", "B", "C", "D"};
  if (i < std::size(names)) return names[i];
  return i == std::size(names) && a.z.defined() ? "z" : "h0";
}

ScanArguments in_double(const ScanArguments& a) {
  const auto convert = [](const torch::Tensor& t) {
    return t.defined() ? t.detach().to(torch::kFloat64) : t;
  };
  return {convert(a.u), convert(a.delta), convert(a.A), convert(a.B),
          convert(a.C), convert(a.D),     convert(a.z), convert(a.h0)};
}

struct Outcome {
  torch::Tensor y, last_state;
  std::vector<torch::Tensor> gradients;
};

/// Random factors of the two results: their weighted sum is what is differentiated.
struct Factors {
  torch::Tensor y, last_state;
  explicit Factors(const ScanArguments& a) : y(torch::randn_like(a.u)) {
    last_state = torch::randn({a.u.size(0), a.u.size(2), a.A.size(1)});
  }
};

template <typename Scan>
Outcome run(ScanArguments a, const Factors& factors, Scan scan) {
  std::vector<torch::Tensor> leaves;
  for (torch::Tensor* tensor : differentiated(a)) leaves.push_back(tensor->detach().requires_grad_());
  const auto list = differentiated(a);
  for (std::size_t i = 0; i < list.size(); ++i) *list[i] = leaves[i];
  const ScanResult result = scan(a);
  ((result.y * factors.y).sum() + (result.last_state * factors.last_state).sum()).backward();
  Outcome outcome{result.y.detach(), result.last_state.detach(), {}};
  for (const auto& leaf : leaves) outcome.gradients.push_back(leaf.grad());
  return outcome;
}

/// Largest difference relative to the largest entry.
double distance(const torch::Tensor& a, const torch::Tensor& b) {
  const auto exact = b.to(torch::kFloat64);
  const double scale = std::max(exact.abs().max().item<double>(), 1e-12);
  return (a.to(torch::kFloat64) - exact).abs().max().item<double>() / scale;
}

class SelectiveScan : public testing::TestWithParam<Case> {};

TEST_P(SelectiveScan, EqualsTheReferenceInValuesAndGradientsOnEveryInstructionSet) {
  torch::manual_seed(7);
  const ScanArguments a = random_arguments(GetParam());
  const Factors factors(a);
  const Outcome exact = run(in_double(a), factors, plain_scan);
  for (const MambaKernels* kernels : supported_mamba_kernels()) {
    SCOPED_TRACE(kernels->name);
    const Outcome fused =
        run(a, factors, [&](const ScanArguments& f) { return selective_scan_on(*kernels, f); });
    EXPECT_LT(distance(fused.y, exact.y), 1e-5);
    EXPECT_LT(distance(fused.last_state, exact.last_state), 1e-5);
    ASSERT_EQ(fused.gradients.size(), exact.gradients.size());
    for (std::size_t i = 0; i < exact.gradients.size(); ++i) {
      ASSERT_TRUE(fused.gradients[i].defined()) << name_of(a, i);
      ASSERT_EQ(fused.gradients[i].sizes(), exact.gradients[i].sizes()) << name_of(a, i);
      EXPECT_LT(distance(fused.gradients[i], exact.gradients[i]), 1e-4) << name_of(a, i);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Shapes, SelectiveScan,
                         testing::Values(Case{1, 1, 1, 1, false, false}, Case{2, 1, 16, 16, true, true},
                                         Case{3, 15, 17, 3, true, false}, Case{2, 16, 32, 8, true, true},
                                         Case{2, 17, 31, 16, false, true}, Case{1, 33, 5, 13, true, false},
                                         Case{4, 100, 48, 16, true, false}, Case{1, 70, 20, 8, false, false},
                                         Case{9, 5, 7, 2, true, true}, Case{2, 40, 15, 33, true, true}));

TEST(SelectiveScanOperator, AgreesWithFiniteDifferencesOfTheReference) {
  torch::manual_seed(3);
  const ScanArguments a = random_arguments({1, 4, 2, 3, true, true});
  const Factors factors(a);
  const Outcome fused = run(a, factors, selective_scan);
  const auto loss = [&](const ScanArguments& d) {
    const ScanResult result = plain_scan(d);
    return ((result.y * factors.y).sum() + (result.last_state * factors.last_state).sum()).item<double>();
  };
  constexpr double kStep = 1e-6;
  ScanArguments moved = in_double(a);
  const auto list = differentiated(moved);
  for (std::size_t i = 0; i < list.size(); ++i) {
    double* values = list[i]->data_ptr<double>();
    for (std::int64_t k = 0; k < list[i]->numel(); ++k) {
      const double kept = values[k];
      values[k] = kept + kStep;
      const double above = loss(moved);
      values[k] = kept - kStep;
      const double below = loss(moved);
      values[k] = kept;
      const double slope = (above - below) / (2 * kStep);
      EXPECT_NEAR(fused.gradients[i].contiguous().data_ptr<float>()[k], slope, 1e-4 * (1 + std::abs(slope)))
          << name_of(a, i) << "[" << k << "]";
    }
  }
}

TEST(SelectiveScanOperator, IsBitEqualForAnyThreadCount) {
  torch::manual_seed(11);
  const ScanArguments a = random_arguments({5, 37, 41, 16, true, true});
  const Factors factors(a);
  const int threads = at::get_num_threads();
  at::set_num_threads(1);
  const Outcome alone = run(a, factors, selective_scan);
  for (const int count : {2, 3, 4}) {
    at::set_num_threads(count);
    const Outcome shared = run(a, factors, selective_scan);
    EXPECT_TRUE(torch::equal(alone.y, shared.y)) << count << " threads";
    for (std::size_t i = 0; i < alone.gradients.size(); ++i) {
      EXPECT_TRUE(torch::equal(alone.gradients[i], shared.gradients[i]))
          << name_of(a, i) << ", " << count << " threads";
    }
  }
  at::set_num_threads(threads);
}

TEST(SelectiveScanOperator, IsCausal) {
  torch::manual_seed(2);
  const ScanArguments a = random_arguments({1, 40, 20, 16, true, false});
  const auto scan = [&] { return selective_scan(a).y; };
  const torch::Tensor before = scan();
  a.u.select(1, 21).add_(1.0);
  a.delta.select(1, 21).mul_(2.0);
  const torch::Tensor after = scan();
  EXPECT_TRUE(torch::equal(before.narrow(1, 0, 21), after.narrow(1, 0, 21)));
  EXPECT_GT(distance(after.narrow(1, 22, 18), before.narrow(1, 22, 18)), 1e-3);
}

TEST(SelectiveScanOperator, CutAnywhereEqualsTheWholeInValuesAndGradients) {
  torch::manual_seed(4);
  const ScanArguments a = random_arguments({2, 50, 19, 5, true, true});
  const Factors factors(a);
  const Outcome whole = run(a, factors, selective_scan);
  const auto part = [](const ScanArguments& f, std::int64_t first, std::int64_t count,
                       const torch::Tensor& h0) {
    const auto cut = [&](const torch::Tensor& t) { return t.narrow(1, first, count); };
    return ScanArguments{cut(f.u), cut(f.delta), f.A, cut(f.B), cut(f.C), f.D, cut(f.z), h0};
  };
  for (const std::int64_t at : {1, 16, 33, 49}) {
    const Outcome cut = run(a, factors, [&](const ScanArguments& f) {
      const ScanResult head = selective_scan(part(f, 0, at, f.h0));
      const ScanResult tail = selective_scan(part(f, at, 50 - at, head.last_state));
      return ScanResult{torch::cat({head.y, tail.y}, 1), tail.last_state};
    });
    EXPECT_TRUE(torch::equal(cut.y, whole.y)) << at;
    EXPECT_TRUE(torch::equal(cut.last_state, whole.last_state)) << at;
    for (std::size_t i = 0; i < whole.gradients.size(); ++i) {
      EXPECT_LT(distance(cut.gradients[i], whole.gradients[i]), 1e-5) << name_of(a, i) << " cut at " << at;
    }
  }
}

TEST(SelectiveScanOperator, IsDifferentiableThroughEitherResultAlone) {
  torch::manual_seed(8);
  const ScanArguments a = random_arguments({2, 7, 5, 3, false, true});
  for (const bool through_y : {true, false}) {
    const auto gradient = [&](auto scan) {
      ScanArguments f = a;
      f.h0 = a.h0.clone().requires_grad_();
      const ScanResult result = scan(f);
      (through_y ? result.y : result.last_state).square().sum().backward();
      return f.h0.grad();
    };
    const torch::Tensor exact = gradient(plain_scan);
    EXPECT_GT(exact.abs().max().item<float>(), 1e-3);
    EXPECT_LT(distance(gradient(selective_scan), exact), 1e-5) << (through_y ? "y" : "last state");
  }
}

TEST(SelectiveScanOperator, ReadsSlicesOfColumnsAsTheyLie) {
  torch::manual_seed(5);
  ScanArguments a = random_arguments({3, 20, 18, 4, true, false});
  const torch::Tensor plain = selective_scan(a).y;
  const auto u_and_z = torch::cat({a.u, a.z}, 2).chunk(2, 2), B_and_C = torch::cat({a.B, a.C}, 2).chunk(2, 2);
  const torch::Tensor turned = a.delta.transpose(0, 1).contiguous().transpose(0, 1);
  ASSERT_FALSE(u_and_z[1].is_contiguous());
  const ScanArguments sliced{u_and_z[0], turned, a.A, B_and_C[0], B_and_C[1], a.D, u_and_z[1]};
  EXPECT_TRUE(torch::equal(selective_scan(sliced).y, plain));
}

TEST(SelectiveScanOperator, StaysFiniteWhereTheStateDiesAtOnceAndPassesNaNOn) {
  ScanArguments a = random_arguments({1, 6, 16, 16, false, false});
  a.delta.fill_(1e6);
  a.B.fill_(1e-6);
  EXPECT_TRUE(torch::isfinite(selective_scan(a).y).all().item<bool>());
  a.u.index_put_({0, 2, 3}, std::numeric_limits<float>::quiet_NaN());
  const torch::Tensor y = selective_scan(a).y;
  EXPECT_TRUE(torch::isnan(y.index({0, 2, 3})).item<bool>());
  EXPECT_TRUE(torch::isfinite(y.select(2, 4)).all().item<bool>());
}

TEST(SelectiveScanOperator, NamesTheTensorThatDoesNotFit) {
  const ScanArguments good = random_arguments({2, 3, 4, 5, true, true});
  const auto message = [](const ScanArguments& a) -> std::string {
    try {
      selective_scan(a);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(message(good), "");
  ScanArguments bad = good;
  bad.delta = torch::zeros({2, 3, 5});
  EXPECT_NE(message(bad).find("delta must be float32 [2, 3, 4]"), std::string::npos) << message(bad);
  bad = good;
  bad.A = good.A.to(torch::kFloat64);
  EXPECT_NE(message(bad).find("A must be float32 [4, 5]"), std::string::npos) << message(bad);
  bad = good;
  bad.B = torch::zeros({2, 3, 65});
  EXPECT_NE(message(bad).find("1 to 64 states"), std::string::npos) << message(bad);
}

TEST(SelectiveScanOperator, RefusesASecondDerivative) {
  ScanArguments a = random_arguments({1, 3, 4, 2, false, false});
  a.u.requires_grad_();
  const torch::Tensor y = selective_scan(a).y;
  EXPECT_ANY_THROW(torch::autograd::grad({y.sum()}, {a.u}, {}, true, /*create_graph=*/true));
}

}  // namespace
}  // namespace flowscope
