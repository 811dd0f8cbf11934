#include "policy/clip/text_encoder.h"

#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "policy/clip/published.h"

namespace flowscope {
namespace {

constexpr std::int64_t head_channels = 64;

}  // namespace

torch::Tensor ClipTextEncoder::WeightAndBias::linear(const torch::Tensor& x) const {
  return torch::linear(x, weight, bias);
}

torch::Tensor ClipTextEncoder::WeightAndBias::norm(const torch::Tensor& x) const {
  return torch::layer_norm(x, weight.sizes(), weight, bias, 1e-5);
}

ClipTextEncoder::ClipTextEncoder(const TensorsByName& weights, torch::Device device)
    : embedding_(clip_tensor(weights, "token_embedding.weight", {-1, -1}).to(device)),
      position_(clip_tensor(weights, "positional_embedding", {-1, embedding_.size(1)}).to(device)) {
  const std::int64_t c = width();
  if (c % head_channels != 0) {
    throw std::invalid_argument("tensor token_embedding.weight: its width " + std::to_string(c) +
                                " is no multiple of " + std::to_string(head_channels));
  }
  const auto load = [&](const std::string& weight, const std::string& bias, std::vector<std::int64_t> shape) {
    return WeightAndBias{clip_tensor(weights, weight, shape).to(device),
                         clip_tensor(weights, bias, {shape.front()}).to(device)};
  };
  const auto named = [&](const std::string& name, std::vector<std::int64_t> shape) {
    return load(name + ".weight", name + ".bias", std::move(shape));
  };
  const std::string prefix = "transformer.resblocks.";
  for (int k = 0; k == 0 || weights.contains(prefix + std::to_string(k) + ".attn.in_proj_weight"); ++k) {
    const std::string name = prefix + std::to_string(k) + ".";
    blocks_.push_back({.norm1 = named(name + "ln_1", {c}),
                       .in = load(name + "attn.in_proj_weight", name + "attn.in_proj_bias", {3 * c, c}),
                       .out = named(name + "attn.out_proj", {c, c}),
                       .norm2 = named(name + "ln_2", {c}),
                       .expand = named(name + "mlp.c_fc", {4 * c, c}),
                       .reduce = named(name + "mlp.c_proj", {c, 4 * c})});
  }
  final_norm_ = named("ln_final", {c});
}

torch::Tensor ClipTextEncoder::Block::attend(const torch::Tensor& x) const {
  const std::int64_t n = x.size(0), length = x.size(1), c = x.size(2), heads = c / head_channels;
  const torch::Tensor qkv = in.linear(x).view({n, length, 3, heads, head_channels}).permute({2, 0, 3, 1, 4});
  const torch::Tensor query = qkv[0] / std::sqrt(static_cast<double>(head_channels));
  const torch::Tensor later =
      torch::full({length, length}, -std::numeric_limits<float>::infinity(), x.options()).triu(1);
  const torch::Tensor weight = (query.matmul(qkv[1].transpose(-1, -2)) + later).softmax(-1);
  return out.linear(weight.matmul(qkv[2]).transpose(1, 2).reshape({n, length, c}));
}

torch::Tensor ClipTextEncoder::Block::operator()(const torch::Tensor& x) const {
  const torch::Tensor y = x + attend(norm1.norm(x));
  const torch::Tensor wide = expand.linear(norm2.norm(y));
  return y + reduce.linear(wide * torch::sigmoid(1.702 * wide));
}

torch::Tensor ClipTextEncoder::forward(const torch::Tensor& ids) const {
  if (ids.dim() != 2 || ids.scalar_type() != torch::kInt64 || ids.numel() == 0 || ids.size(1) > context()) {
    std::ostringstream text;
    text << "clip text: ids must be int64 [N, L] with L at most " << context() << ", not " << ids.toString()
         << " " << ids.sizes();
    throw std::invalid_argument(text.str());
  }
  if (ids.min().item<std::int64_t>() < 0 || ids.max().item<std::int64_t>() >= vocabulary())
    throw std::invalid_argument("clip text: an id is outside 0 … " + std::to_string(vocabulary() - 1));
  const torch::NoGradGuard frozen;
  torch::Tensor x = embedding_.index({ids.to(embedding_.device())}) + position_.narrow(0, 0, ids.size(1));
  for (const Block& block : blocks_) x = block(x);
  return final_norm_.norm(x);
}

}  // namespace flowscope
