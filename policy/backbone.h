// The sequence model behind the encoders and the velocity network.
#pragma once

#include <torch/torch.h>

#include <string>

namespace flowscope {

/// A stack of blocks over [batch, length, channels]; causal, so what stands last has seen everything.
class BackboneImpl : public torch::nn::Module {
 public:
  /// condition [batch, condition_dim], undefined when the stack takes none.
  virtual torch::Tensor forward(const torch::Tensor& x, const torch::Tensor& condition = {}) = 0;
};
using Backbone = std::shared_ptr<BackboneImpl>;

struct BackboneOptions {
  int channels = 64, d_state = 8, blocks = 1, condition_dim = 0;
};

/// kind "mamba". Throws std::invalid_argument for another.
Backbone make_backbone(const std::string& kind, const BackboneOptions& options);

}  // namespace flowscope
