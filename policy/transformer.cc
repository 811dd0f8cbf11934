#include "policy/transformer.h"

#include <stdexcept>
#include <string>

#include "policy/attention.h"
#include "policy/pointwise.h"

namespace flowscope {
namespace {

constexpr int most_heads = 8, least_head_width = 8;

int heads_of(int channels) {
  for (int heads = most_heads; heads > 1; --heads)
    if (channels % heads == 0 && channels / heads >= least_head_width) return heads;
  return 1;
}

class TransformerBlock : public torch::nn::Module {
 public:
  explicit TransformerBlock(const BackboneOptions& o)
      : channels_(o.channels), heads_(heads_of(o.channels)), condition_dim_(o.condition_dim) {
    using torch::nn::LayerNorm, torch::nn::LayerNormOptions, torch::nn::Linear;
    const int wide = (3 * channels_ + 1) / 2;
    attention_norm_ = register_module("attention_norm", LayerNorm(LayerNormOptions({channels_})));
    qkv_ = register_module("qkv", Linear(channels_, 3 * channels_));
    mix_ = register_module("mix", Linear(channels_, channels_));
    feed_norm_ = register_module("feed_norm", LayerNorm(LayerNormOptions({channels_})));
    feed_in_ = register_module("feed_in", Linear(channels_, wide));
    feed_out_ = register_module("feed_out", Linear(wide, channels_));
    if (condition_dim_ > 0) {
      adaptive_ = register_module("adaptive", Linear(condition_dim_, 4 * channels_));
      const torch::NoGradGuard no_grad;
      adaptive_->weight.zero_();
      adaptive_->bias.zero_();
    }
  }

  /// `memory`: keys and values so far, undefined at the start; replaced by those with the tokens of x.
  torch::Tensor forward_from(std::pair<torch::Tensor, torch::Tensor>& memory, const torch::Tensor& x,
                             const torch::Tensor& condition) {
    check(x, condition);
    std::vector<torch::Tensor> adapted(4);
    if (condition.defined()) adapted = adaptive_->forward(torch::silu(condition)).unsqueeze(1).chunk(4, 2);
    const std::int64_t batch = x.size(0), length = x.size(1);
    const auto qkv = qkv_->forward(normed(attention_norm_, x, adapted[0], adapted[1]))
                         .view({batch, length, 3, heads_, channels_ / heads_})
                         .permute({2, 0, 3, 1, 4})
                         .unbind(0);
    const bool first = !memory.first.defined();
    memory = {first ? qkv[1].contiguous() : torch::cat({memory.first, qkv[1]}, 2),
              first ? qkv[2].contiguous() : torch::cat({memory.second, qkv[2]}, 2)};
    const torch::Tensor seen = attention(qkv[0], memory.first, memory.second);
    const torch::Tensor y = x + mix_->forward(seen.transpose(1, 2).reshape({batch, length, channels_}));
    return y + feed_out_->forward(gelu_of(feed_in_->forward(normed(feed_norm_, y, adapted[2], adapted[3]))));
  }

 private:
  static torch::Tensor normed(torch::nn::LayerNorm& norm, const torch::Tensor& x, const torch::Tensor& scale,
                              const torch::Tensor& shift) {
    const torch::Tensor y = norm->forward(x);
    return scale.defined() ? y * (1 + scale) + shift : y;
  }
  void check(const torch::Tensor& x, const torch::Tensor& condition) const {
    if (x.dim() != 3 || x.size(2) != channels_)
      throw std::invalid_argument("transformer: x must be [batch, length, " + std::to_string(channels_) +
                                  "]");
    if (condition.defined() != (condition_dim_ > 0))
      throw std::invalid_argument(std::string("transformer: a condition is ") +
                                  (condition.defined() ? "given but not expected" : "expected"));
  }

  const int channels_, heads_, condition_dim_;
  torch::nn::LayerNorm attention_norm_{nullptr}, feed_norm_{nullptr};
  torch::nn::Linear qkv_{nullptr}, mix_{nullptr}, feed_in_{nullptr}, feed_out_{nullptr}, adaptive_{nullptr};
};

class TransformerStack : public BackboneImpl {
 public:
  explicit TransformerStack(const BackboneOptions& o) {
    if (o.channels < 1 || o.blocks < 0 || o.condition_dim < 0)
      throw std::invalid_argument("transformer: channels must be at least 1, blocks and condition_dim 0");
    for (int i = 0; i < o.blocks; ++i)
      blocks_.push_back(register_module("block" + std::to_string(i), std::make_shared<TransformerBlock>(o)));
  }
  torch::Tensor forward(const torch::Tensor& x, const torch::Tensor& condition) override {
    BackboneState nothing_before;
    return forward_from(nothing_before, x, condition);
  }
  torch::Tensor forward_from(BackboneState& state, const torch::Tensor& x,
                             const torch::Tensor& condition) override {
    state.resize(blocks_.size());
    torch::Tensor y = x;
    for (std::size_t i = 0; i < blocks_.size(); ++i) y = blocks_[i]->forward_from(state[i], y, condition);
    return y;
  }

 private:
  std::vector<std::shared_ptr<TransformerBlock>> blocks_;
};

}  // namespace

Backbone make_transformer(const BackboneOptions& options) {
  return std::make_shared<TransformerStack>(options);
}

}  // namespace flowscope
