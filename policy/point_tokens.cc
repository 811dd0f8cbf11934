#include "policy/point_tokens.h"

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

BoundTokens PointTokensImpl::forward(const torch::Tensor& features, const torch::Tensor& color,
                                     const torch::Tensor& words, const torch::Tensor& word_color,
                                     const torch::Tensor& is_color, const torch::Tensor& is_word,
                                     const torch::Tensor& mention, const torch::Tensor& extra) {
  torch::Tensor h = in_(features);
  if (extra.defined()) h = h + extra;
  if (!binding_) return {out_->forward(h), torch::zeros({h.size(0), h.size(1), words.size(1)}, h.options())};

  const torch::Tensor width = log_width_.exp();
  const torch::Tensor mask = is_color.unsqueeze(1);
  const torch::Tensor color2 = distance2(color, gain_ * word_color);
  const torch::Tensor hue2 = distance2(hue(color), hue(word_color));
  const torch::Tensor near = torch::exp(-width[0] * color2) * mask;
  const torch::Tensor alike = torch::exp(-width[1] * hue2) * mask;
  const torch::Tensor strictness = strictness_.exp();
  const torch::Tensor mismatch =
      (strictness[0] * color2.clamp_max(farthest2) + strictness[1] * hue2.clamp_max(farthest2)) * mask;
  h = h + torch::bmm(near, sharp_(mention)) + torch::bmm(near * alike, wide_(mention));
  const double scale = 1.0 / std::sqrt(static_cast<double>(h.size(-1)));
  torch::Tensor scores = torch::bmm(query_(torch::gelu(h)), key_(words).transpose(1, 2)) * scale;
  scores = scores.masked_fill((is_word < 0.5).unsqueeze(1), -1e9);
  h = h + torch::bmm(torch::softmax(scores, -1), value_(words));
  return {out_->forward(h), mismatch};
}

}  // namespace flowscope
