// What makes points into tokens without gradients, against torch's operators.
#include "policy/fused_tokens.h"

#include <ATen/Parallel.h>
#include <gtest/gtest.h>

#include <map>
#include <string>

#include "policy/fused_groups.h"
#include "policy/mlp.h"
#include "policy/torch_parts.h"

namespace flowscope {
namespace {

double distance(const torch::Tensor& a, const torch::Tensor& b) {
  return (a.to(torch::kFloat64) - b.to(torch::kFloat64)).abs().max().item<double>();
}

std::map<std::string, torch::Tensor> parameters_of(const torch::nn::Module& module) {
  std::map<std::string, torch::Tensor> all;
  for (const auto& item : module.named_parameters()) all[item.key()] = item.value().detach();
  return all;
}

TEST(TokenKernels, ActivateAsTorchOnEveryInstructionSet) {
  const torch::Tensor x = torch::linspace(-12, 12, 4803);
  const torch::Tensor exact = torch::gelu(x.to(torch::kFloat64));
  for (const TokenKernels* kernels : supported_token_kernels()) {
    const torch::Tensor y = x.clone();
    kernels->gelu(y.data_ptr<float>(), y.numel());
    EXPECT_LT(((y - exact) / (1 + exact.abs())).abs().max().item<double>(), 5e-7) << kernels->name;
    torch::Tensor broken = torch::full({3}, std::numeric_limits<float>::quiet_NaN());
    kernels->gelu(broken.data_ptr<float>(), 3);
    EXPECT_TRUE(torch::isnan(broken).all().item<bool>()) << kernels->name;
  }
}

TEST(TokenKernels, AttendToWordsOnlyOrToAllAlikeWhereThereAreNone) {
  torch::manual_seed(1);
  for (const std::int64_t words : {1, 5, 16, 53}) {
    const torch::Tensor scores = 4 * torch::randn({9, words}), bias = torch::randn({words});
    for (const bool any : {true, false}) {
      const torch::Tensor is_word =
          any ? (torch::arange(words) % 3 != 2).to(torch::kFloat32) : torch::zeros({words});
      const torch::Tensor exact = torch::softmax(
          (0.25 * scores + bias).to(torch::kFloat64).masked_fill((is_word < 0.5).unsqueeze(0), -1e9), -1);
      for (const TokenKernels* kernels : supported_token_kernels()) {
        const torch::Tensor y = scores.clone();
        kernels->attend(y.data_ptr<float>(), 9, words, 0.25f, bias.data_ptr<float>(),
                        is_word.data_ptr<float>());
        EXPECT_LT(distance(y, exact), 1e-6) << kernels->name << ", " << words << " words";
      }
    }
  }
}

struct TokenCase {
  bool binding, extra;
  std::int64_t points, words;
};

class FusedTokens : public testing::TestWithParam<TokenCase> {};

TEST_P(FusedTokens, EqualTorchsOnEveryInstructionSetAndForAnyThreadCount) {
  const torch::NoGradGuard no_grad;
  torch::manual_seed(4);
  const TokenCase c = GetParam();
  constexpr int scenes = 2, channels = 40, features = 11;
  PointTokens tokens(features, channels, c.binding);
  tokens->run_by(ScanPath::operators);
  const torch::Tensor x = torch::randn({scenes, c.points, features}),
                      color = torch::rand({scenes, c.points, 3}),
                      extra = c.extra ? torch::randn({scenes, c.points, channels}) : torch::Tensor();
  const torch::Tensor is_word = (torch::arange(c.words) < 3).to(torch::kFloat32).expand({scenes, c.words}),
                      is_color = (torch::arange(c.words) == 1).to(torch::kFloat32).expand({scenes, c.words});
  const WordKeys words =
      tokens->read_words(torch::randn({scenes, c.words, channels}), torch::rand({scenes, c.words, 3}),
                         is_color, is_word, torch::randn({scenes, c.words, channels}));
  const BoundTokens exact = tokens->forward(x, color, words, extra);
  tokens->run_by(ScanPath::fused);
  const BoundTokens fast = tokens->forward(x, color, words, extra);
  EXPECT_LT(distance(fast.token, exact.token), 1e-4);
  EXPECT_LT(distance(fast.mismatch, exact.mismatch), 1e-5);
  ASSERT_EQ(fast.mismatch.sizes(), exact.mismatch.sizes());

  auto p = parameters_of(*tokens);
  const auto at = [](const torch::Tensor& t, int i) { return t[i].item<float>(); };
  const TokenWeights weights{p["in.weight"],
                             p["in.bias"],
                             p["out.1.weight"],
                             p["out.1.bias"],
                             p["out.3.weight"],
                             p["out.3.bias"],
                             p["query.weight"],
                             p["query.bias"],
                             at(p["log_width"].exp(), 0),
                             at(p["log_width"].exp(), 1),
                             at(p["strictness"].exp(), 0),
                             at(p["strictness"].exp(), 1),
                             0.5f};
  const int threads = at::get_num_threads();
  for (std::size_t i = 0; i < supported_token_kernels().size(); ++i) {
    torch::Tensor first;
    for (const int count : {1, 2}) {
      at::set_num_threads(count);
      const BoundTokens mine = fused_tokens(weights, x, color, words, extra, *supported_mamba_kernels()[i],
                                            *supported_token_kernels()[i]);
      EXPECT_LT(distance(mine.token, exact.token), 1e-4) << supported_token_kernels()[i]->name;
      if (!first.defined()) first = mine.token;
      EXPECT_TRUE(torch::equal(first, mine.token)) << supported_token_kernels()[i]->name;
    }
  }
  at::set_num_threads(threads);
}

INSTANTIATE_TEST_SUITE_P(Kinds, FusedTokens,
                         testing::Values(TokenCase{true, false, 300, 53}, TokenCase{true, true, 131, 7},
                                         TokenCase{false, true, 17, 5}, TokenCase{true, false, 1, 3}));

TEST(FusedMlp, EqualsTorchsForAnyShapeAndThreadCount) {
  torch::manual_seed(9);
  Mlp mlp(7, 24, 5);
  const int threads = at::get_num_threads();
  for (const auto& shape : {std::vector<std::int64_t>{7}, {1, 7}, {3, 300, 7}}) {
    const torch::Tensor x = torch::randn(shape);
    const torch::Tensor exact = mlp(x).detach();  // with gradients: torch's operators
    const torch::NoGradGuard no_grad;
    torch::Tensor first;
    for (const int count : {1, 2}) {
      at::set_num_threads(count);
      const torch::Tensor mine = mlp(x);
      ASSERT_EQ(mine.sizes(), exact.sizes());
      EXPECT_FALSE(torch::equal(mine, exact)) << "not the kernels' rounding: was it run by torch?";
      EXPECT_LT(distance(mine, exact), 1e-5);
      if (!first.defined()) first = mine;
      EXPECT_TRUE(torch::equal(first, mine));
    }
    at::set_num_threads(threads);
  }
}

TEST(FusedGroups, EqualThePlainLoopOnEveryInstructionSet) {
  const torch::NoGradGuard no_grad;
  torch::manual_seed(6);
  constexpr std::int64_t batch = 2, points = 40, groups = 11, size = 5, channels = 24;
  const auto square = [] { return 0.3 * torch::randn({channels, channels}); };
  const GroupWeights w{square(), torch::randn({channels}), torch::randn({channels, 3}),
                       square(), torch::randn({channels}), square(),
                       square(), torch::randn({channels})};
  const torch::Tensor tokens = torch::randn({batch, points, channels}),
                      relative = torch::randn({batch, groups, size, 3}),
                      neighbour = torch::randint(batch * points, {batch * groups * size}, torch::kInt64);
  const auto linear = [](const torch::Tensor& x, const torch::Tensor& weight, const torch::Tensor& bias) {
    return torch::matmul(x, weight.t().to(torch::kFloat64)) + bias;
  };
  const torch::Tensor zero = torch::zeros({channels});
  const torch::Tensor entered = linear(tokens.to(torch::kFloat64), w.token_in, w.token_in_bias).flatten(0, 1);
  const torch::Tensor h =
      torch::gelu(entered.index_select(0, neighbour).view({batch, groups, size, channels}) +
                  linear(relative.to(torch::kFloat64), w.place_in, zero));
  const torch::Tensor u =
      torch::gelu(linear(h, w.inner, w.inner_bias) + linear(h.amax(2), w.pooled, zero).unsqueeze(2));
  const torch::Tensor exact = linear(u.amax(2), w.out, w.out_bias);
  const int threads = at::get_num_threads();
  for (std::size_t i = 0; i < supported_token_kernels().size(); ++i) {
    torch::Tensor first;
    for (const int count : {1, 2}) {
      at::set_num_threads(count);
      const torch::Tensor mine = fused_groups(w, tokens, relative, neighbour, *supported_mamba_kernels()[i],
                                              *supported_token_kernels()[i]);
      EXPECT_LT(distance(mine, exact), 1e-4) << supported_token_kernels()[i]->name;
      if (!first.defined()) first = mine;
      EXPECT_TRUE(torch::equal(first, mine)) << supported_token_kernels()[i]->name;
    }
  }
  at::set_num_threads(threads);
}

}  // namespace
}  // namespace flowscope
