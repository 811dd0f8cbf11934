#include "policy/point_tokens.h"

#include "policy/fused_tokens.h"
#include "policy/packed_layer.h"
#include "policy/pointwise.h"

namespace flowscope {
namespace {

torch::Tensor distance2(const torch::Tensor& a, const torch::Tensor& b) {
  return (a.unsqueeze(2) - b.unsqueeze(1)).square().sum(-1);
}

constexpr double farthest2 = 0.5;  // colours further apart are all equally wrong

// Colour with its brightness taken off: what shading leaves alone.
torch::Tensor hue(const torch::Tensor& rgb) {
  const torch::Tensor centered = rgb - rgb.mean(-1, true);
  return centered / (centered.norm(2, -1, true) + 0.1);
}

}  // namespace

PointTokensImpl::PointTokensImpl(int features, int channels, bool binding)
    : binding_(binding),
      in_(register_module("in", torch::nn::Linear(features, channels))),
      query_(register_module("query", torch::nn::Linear(channels, channels))),
      key_(register_module("key", torch::nn::Linear(channels, channels))),
      value_(register_module("value", torch::nn::Linear(channels, channels))),
      sharp_(register_module("sharp",
                             torch::nn::Linear(torch::nn::LinearOptions(channels, channels).bias(false)))),
      wide_(register_module("wide",
                            torch::nn::Linear(torch::nn::LinearOptions(channels, channels).bias(false)))),
      out_(register_module("out",
                           torch::nn::Sequential(torch::nn::GELU(), torch::nn::Linear(channels, channels),
                                                 torch::nn::GELU(), torch::nn::Linear(channels, channels)))),
      log_width_(register_parameter("log_width", torch::tensor({3.f, 1.f}))),
      strictness_(register_parameter("strictness", torch::tensor({2.3f, 2.3f}))),
      gain_(register_parameter("gain", torch::tensor({1.f}))) {}

WordKeys PointTokensImpl::read_words(const torch::Tensor& words, const torch::Tensor& word_color,
                                     const torch::Tensor& is_color, const torch::Tensor& is_word,
                                     const torch::Tensor& mention) {
  WordKeys keys;
  keys.is_color = is_color.unsqueeze(1);
  keys.is_word = is_word.unsqueeze(1);
  if (!binding_) return keys;
  keys.key = key_(words);
  keys.value = value_(words);
  keys.sharp = sharp_(mention);
  keys.wide = wide_(mention);
  keys.color = gain_ * word_color;
  keys.hue = hue(word_color);
  return keys;
}

torch::Tensor PointTokensImpl::read_out(const torch::Tensor& h) {
  auto* first = out_->ptr(1)->as<torch::nn::Linear>();
  auto* second = out_->ptr(3)->as<torch::nn::Linear>();
  return second->forward(gelu_of(first->forward(gelu_of(h))));
}

TokenWeights PointTokensImpl::weights() const {
  const auto* first = out_->ptr(1)->as<torch::nn::Linear>();
  const auto* second = out_->ptr(3)->as<torch::nn::Linear>();
  const torch::Tensor width = log_width_.exp(), strictness = strictness_.exp();
  return {in_->weight,
          in_->bias,
          first->weight,
          first->bias,
          second->weight,
          second->bias,
          query_->weight,
          query_->bias,
          width[0].item<float>(),
          width[1].item<float>(),
          strictness[0].item<float>(),
          strictness[1].item<float>(),
          static_cast<float>(farthest2)};
}

BoundTokens PointTokensImpl::forward(const torch::Tensor& features, const torch::Tensor& color,
                                     const WordKeys& w, const torch::Tensor& extra) {
  if (path_ == ScanPath::fused && plain_arrays(features, in_->weight))
    return fused_tokens(weights(), features, color, w, extra);
  torch::Tensor h = in_(features);
  if (extra.defined()) h = h + extra;
  if (!binding_) return {read_out(h), torch::zeros({h.size(0), h.size(1), w.is_word.size(2)}, h.options())};

  const torch::Tensor width = log_width_.exp();
  const torch::Tensor color2 = distance2(color, w.color);
  const torch::Tensor hue2 = distance2(hue(color), w.hue);
  const torch::Tensor near = torch::exp(-width[0] * color2) * w.is_color;
  const torch::Tensor alike = torch::exp(-width[1] * hue2);
  const torch::Tensor strictness = strictness_.exp();
  const torch::Tensor mismatch =
      (strictness[0] * color2.clamp_max(farthest2) + strictness[1] * hue2.clamp_max(farthest2)) * w.is_color;
  h = h + torch::bmm(near, w.sharp) + torch::bmm(near * alike, w.wide);
  const double scale = 1.0 / std::sqrt(static_cast<double>(h.size(-1)));
  torch::Tensor scores = torch::bmm(query_(gelu_of(h)), w.key.transpose(1, 2)) * scale;
  scores = scores.masked_fill(w.is_word < 0.5, -1e9);
  h = h + torch::bmm(torch::softmax(scores, -1), w.value);
  return {read_out(h), mismatch};
}

}  // namespace flowscope
