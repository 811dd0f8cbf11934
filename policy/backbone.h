// The sequence model behind the encoders and the velocity network.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "policy/torch_parts.h"

namespace flowscope {

/// What a stack remembers of the tokens behind it, two tensors per block with the batch first. Mamba: the
/// convolution's tail [B, d_conv - 1, E] and the scan's state [B, E, N]; transformer: keys and values.
using BackboneState = std::vector<std::pair<torch::Tensor, torch::Tensor>>;

/// How a stack computes. `fused`: without gradients on its own path over plain arrays where it has one, else
/// as `operators`: torch's modules around the fused scan. `plain`: the scan as a loop of torch's operators,
/// token by token; for comparisons.
enum class ScanPath { fused, operators, plain };

/// A stack of blocks over [batch, length, channels]; what stands last has seen everything.
class BackboneImpl : public torch::nn::Module {
 public:
  /// condition [batch, condition_dim], undefined when the stack takes none.
  virtual torch::Tensor forward(const torch::Tensor& x, const torch::Tensor& condition = {}) = 0;
  /// The same for tokens that follow those that `state` remembers (empty: none); `state` then remembers these
  /// too. Handles are replaced, never written into: a copied state can be run on from again and again.
  virtual torch::Tensor forward_from(BackboneState& state, const torch::Tensor& x,
                                     const torch::Tensor& condition = {}) = 0;
  /// `fused` where never called; a stack without a scan ignores it.
  virtual void run_by(ScanPath) {}
};
using Backbone = std::shared_ptr<BackboneImpl>;

/// Every row `draws` times in a row.
BackboneState repeat_rows(const BackboneState& state, std::int64_t draws);

struct BackboneOptions {
  int channels = 64, d_state = 8, blocks = 1, condition_dim = 0;
};

/// kind "mamba". Throws std::invalid_argument for another.
Backbone make_backbone(const std::string& kind, const BackboneOptions& options);

}  // namespace flowscope
