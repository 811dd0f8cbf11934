// CLIP's visual trunk: ResNet-50 with a stem of three convolutions and an average pool before every stride,
// so that strides do not alias. Frozen: no weight learns and no gradient passes. Source: arXiv 2103.00020
// §2.4; strides after arXiv 1904.11486; blocks arXiv 1512.03385.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "policy/safetensors.h"
#include "policy/torch_parts.h"

namespace flowscope {

/// Feature maps [N, channels, H / 2^(i+1), W / 2^(i+1)] at index i; the first is the stem before its pool.
/// Channels of the published trunk: 64, 256, 512, 1024, 2048. Per 128 x 128 picture all of them but the first
/// take 1.9 MiB.
using ClipTaps = std::array<torch::Tensor, 5>;

/// Widths and numbers of blocks are those of the tensors given, so that a small trunk can be built by hand.
/// Batch norms (eps 1e-5, running statistics) are folded into their convolutions. Immutable; belongs to no
/// torch::nn::Module, so no optimiser and no checkpoint sees its weights.
class ClipResNet {
 public:
  /// Takes what begins with "visual." (published.h). Throws std::invalid_argument naming the tensor that is
  /// missing or does not fit.
  explicit ClipResNet(const TensorsByName& weights, torch::Device device = torch::kCPU);

  /// `pictures` float32 [N, 3, H, W], RGB in [0, 1] on the weights' device, H and W multiples of 32; CLIP's
  /// mean and deviation are applied inside. Throws std::invalid_argument for other shapes or types.
  ClipTaps forward(const torch::Tensor& pictures) const;

  std::vector<std::int64_t> tap_channels() const;
  torch::Device device() const { return stem_.front().weight.device(); }

 private:
  /// A convolution and the batch norm behind it.
  struct Conv {
    torch::Tensor weight, bias;
    std::int64_t stride = 1;
    torch::Tensor operator()(const torch::Tensor& x) const;
  };
  struct Block {
    Conv reduce, spatial, expand;
    std::vector<Conv> shortcut;  ///< none: the input itself
    std::int64_t stride = 1;
    torch::Tensor operator()(const torch::Tensor& x) const;
  };
  static Conv load(const TensorsByName& weights, const std::string& conv, const std::string& norm,
                   std::int64_t from, std::int64_t kernel, torch::Device device);

  std::vector<Conv> stem_;
  std::array<std::vector<Block>, 4> layers_;
  torch::Tensor mean_, deviation_;
};

}  // namespace flowscope
