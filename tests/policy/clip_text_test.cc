// The text transformer against plain loops in double precision.
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "policy/clip/text_branch.h"
#include "tests/support/clip_weights.h"

namespace flowscope {
namespace {

using testing::random_weights;
using testing::Tensors;
using testing::text_shapes;

constexpr std::int64_t width = 128, blocks = 2, context = 9;
constexpr const char* tiny_merges = "l o\nlo w</w>\n";
constexpr std::int64_t vocabulary = 516;

using Row = std::vector<double>;
using Rows = std::vector<Row>;

Row linear(const Row& x, const Tensors& w, const std::string& weight, const std::string& bias) {
  const auto a = w.at(weight).accessor<float, 2>();
  const auto b = w.at(bias).accessor<float, 1>();
  Row y(a.size(0));
  for (std::int64_t i = 0; i < a.size(0); ++i) {
    y[i] = b[i];
    for (std::int64_t j = 0; j < a.size(1); ++j) y[i] += a[i][j] * x[j];
  }
  return y;
}

Row norm(const Row& x, const Tensors& w, const std::string& name) {
  double mean = 0, variance = 0;
  for (const double v : x) mean += v / static_cast<double>(x.size());
  for (const double v : x) variance += (v - mean) * (v - mean) / static_cast<double>(x.size());
  Row y(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    const auto at = static_cast<std::int64_t>(i);
    y[i] = (x[i] - mean) / std::sqrt(variance + 1e-5) * w.at(name + ".weight")[at].item<double>() +
           w.at(name + ".bias")[at].item<double>();
  }
  return y;
}

void attend(Rows& x, const Tensors& w, const std::string& at) {
  Rows qkv;
  for (const Row& row : x)
    qkv.push_back(linear(norm(row, w, at + "ln_1"), w, at + "attn.in_proj_weight", at + "attn.in_proj_bias"));
  for (std::size_t i = 0; i < x.size(); ++i) {
    Row mixed(width);
    for (std::int64_t head = 0; head < width / 64; ++head) {
      Row weight;
      double total = 0;
      for (std::size_t j = 0; j <= i; ++j) {
        double dot = 0;
        for (std::int64_t c = head * 64; c < (head + 1) * 64; ++c) dot += qkv[i][c] * qkv[j][width + c];
        weight.push_back(std::exp(dot / 8));
        total += weight.back();
      }
      for (std::size_t j = 0; j <= i; ++j)
        for (std::int64_t c = head * 64; c < (head + 1) * 64; ++c)
          mixed[c] += weight[j] / total * qkv[j][2 * width + c];
    }
    const Row out = linear(mixed, w, at + "attn.out_proj.weight", at + "attn.out_proj.bias");
    for (std::int64_t c = 0; c < width; ++c) x[i][c] += out[c];
  }
}

Rows reference(const std::vector<std::int64_t>& ids, const Tensors& w) {
  Rows x;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    Row row;
    for (std::int64_t c = 0; c < width; ++c) {
      row.push_back(w.at("token_embedding.weight")[ids[i]][c].item<double>() +
                    w.at("positional_embedding")[static_cast<std::int64_t>(i)][c].item<double>());
    }
    x.push_back(row);
  }
  for (int b = 0; b < blocks; ++b) {
    const std::string at = "transformer.resblocks." + std::to_string(b) + ".";
    attend(x, w, at);
    for (Row& row : x) {
      Row wide = linear(norm(row, w, at + "ln_2"), w, at + "mlp.c_fc.weight", at + "mlp.c_fc.bias");
      for (double& v : wide) v /= 1 + std::exp(-1.702 * v);
      const Row out = linear(wide, w, at + "mlp.c_proj.weight", at + "mlp.c_proj.bias");
      for (std::int64_t c = 0; c < width; ++c) row[c] += out[c];
    }
  }
  for (Row& row : x) row = norm(row, w, "ln_final");
  return x;
}

Tensors small_weights() { return random_weights(text_shapes(width, blocks, vocabulary, context), 8); }

TEST(ClipTextEncoder, GivesTheHiddenStatesOfPlainLoops) {
  const Tensors weights = small_weights();
  const ClipTextEncoder encoder(weights);
  const std::vector<std::vector<std::int64_t>> ids{{3, 0, 515, 7, 7}, {1, 2, 3, 4, 5}};
  const torch::Tensor found =
      encoder.forward(torch::stack({torch::tensor(ids[0]), torch::tensor(ids[1])})).to(torch::kFloat64);
  for (std::int64_t n = 0; n < 2; ++n) {
    const Rows wanted = reference(ids[n], weights);
    double most = 0;
    for (std::int64_t i = 0; i < 5; ++i)
      for (std::int64_t c = 0; c < width; ++c)
        most = std::max(most, std::abs(wanted[i][c] - found[n][i][c].item<double>()));
    EXPECT_LT(most, 1e-4);
  }
}

TEST(ClipTextEncoder, IsCausalAndFrozen) {
  Tensors weights = small_weights();
  for (auto& [name, tensor] : weights) tensor.requires_grad_();
  const ClipTextEncoder encoder(weights);
  const torch::Tensor one = encoder.forward(torch::tensor({{1, 2, 3, 4}}, torch::kInt64));
  const torch::Tensor other = encoder.forward(torch::tensor({{1, 2, 9, 4}}, torch::kInt64));
  EXPECT_FALSE(one.requires_grad());
  EXPECT_TRUE(torch::equal(one.narrow(1, 0, 2), other.narrow(1, 0, 2)));
  EXPECT_FALSE(torch::allclose(one[0][3], other[0][3]));
}

TEST(ClipTextEncoder, SaysWhatDoesNotFit) {
  const ClipTextEncoder encoder(small_weights());
  EXPECT_THROW(encoder.forward(torch::zeros({1, context + 1}, torch::kInt64)), std::invalid_argument);
  EXPECT_THROW(encoder.forward(torch::zeros({1, 3})), std::invalid_argument);
  EXPECT_THROW(encoder.forward(torch::full({1, 3}, vocabulary, torch::kInt64)), std::invalid_argument);
  Tensors changed = small_weights();
  changed.erase("transformer.resblocks.1.mlp.c_proj.bias");
  EXPECT_THROW(ClipTextEncoder{changed}, std::invalid_argument);
  changed = small_weights();
  changed["ln_final.weight"] = torch::zeros({width, 1});
  EXPECT_THROW(ClipTextEncoder{changed}, std::invalid_argument);
}

ClipEncoders small_encoders() {
  ClipEncoders encoders;
  encoders.text = std::make_shared<ClipTextEncoder>(small_weights());
  encoders.tokenizer = std::make_shared<ClipTokenizer>(tiny_merges);
  return encoders;
}

TEST(ClipTextBranch, GivesAnInstructionTheSameVectorsInAnyCompany) {
  const ClipEncoders encoders = small_encoders();
  const ClipText both = encode_texts(encoders, {"low", "low a b"});
  const ClipText alone = encode_texts(encoders, {"low"});
  EXPECT_EQ(both.hidden.sizes(), (std::vector<std::int64_t>{2, 5, width}));
  EXPECT_TRUE(
      torch::equal(both.is_token, torch::tensor({{1.f, 1.f, 1.f, 0.f, 0.f}, {1.f, 1.f, 1.f, 1.f, 1.f}})));
  EXPECT_TRUE(torch::allclose(both.hidden[0].narrow(0, 0, 3), alone.hidden[0], 1e-4, 1e-5));
  EXPECT_EQ(both.hidden[0].narrow(0, 3, 2).abs().sum().item<double>(), 0);
  EXPECT_EQ(both.tokens[1][2], (ClipToken{320, "a"}));
}

TEST(ClipTextBranch, CutsToTheLimitAndTheContext) {
  const ClipEncoders encoders = small_encoders();
  EXPECT_EQ(encode_texts(encoders, {"a a a a a a a a a a a a"}).hidden.size(1), context);
  const ClipText cut = encode_texts(encoders, {"a a a a"}, 4);
  EXPECT_EQ(cut.hidden.size(1), 4);
  EXPECT_EQ(cut.tokens[0].back().id, encoders.tokenizer->end());
  EXPECT_THROW(encode_texts(encoders, {}), std::invalid_argument);
  EXPECT_THROW(encode_texts({}, {"a"}), std::invalid_argument);
}

}  // namespace
}  // namespace flowscope
