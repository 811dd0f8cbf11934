// CLIP's text transformer: one vector per token of an instruction. Frozen. Source: arXiv 2103.00020 §2.4;
// blocks after arXiv 1706.03762 with layer norms first, the activation x sigmoid(1.702 x) and a causal mask.
#pragma once

#include <cstdint>
#include <vector>

#include "policy/safetensors.h"
#include "policy/torch_parts.h"

namespace flowscope {

/// Sizes are those of the tensors given; each head takes 64 channels. Immutable; belongs to no
/// torch::nn::Module, so no optimiser and no checkpoint sees its weights.
class ClipTextEncoder {
 public:
  /// Takes the names of clip_text_tensors (published.h). Throws std::invalid_argument naming the tensor that
  /// is missing or does not fit.
  explicit ClipTextEncoder(const TensorsByName& weights, torch::Device device = torch::kCPU);

  /// `ids` int64 [N, L] of ClipTokenizer, L at most context(); last hidden states [N, L, width], behind the
  /// final layer norm. The mask is causal, so what pads the end changes nothing before it. Throws
  /// std::invalid_argument for other shapes or types and for an id outside the vocabulary.
  torch::Tensor forward(const torch::Tensor& ids) const;

  std::int64_t width() const { return embedding_.size(1); }
  std::int64_t vocabulary() const { return embedding_.size(0); }
  std::int64_t context() const { return position_.size(0); }

 private:
  struct WeightAndBias {
    torch::Tensor weight, bias;
    torch::Tensor linear(const torch::Tensor& x) const;
    torch::Tensor norm(const torch::Tensor& x) const;
  };
  struct Block {
    WeightAndBias norm1, in, out, norm2, expand, reduce;
    torch::Tensor attend(const torch::Tensor& x) const;
    torch::Tensor operator()(const torch::Tensor& x) const;
  };
  torch::Tensor embedding_, position_;
  std::vector<Block> blocks_;
  WeightAndBias final_norm_;
};

}  // namespace flowscope
