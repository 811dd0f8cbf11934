// The trained feature pyramid over the frozen trunk: what the coarse levels know is added to a fine one.
// Source: Lin et al. 2017 (arXiv 1612.03144), as 3D Diffuser Actor uses it over CLIP.
#pragma once

#include <cstdint>
#include <vector>

#include "policy/clip/resnet.h"
#include "policy/torch_parts.h"

namespace flowscope {

/// Index into ClipTaps of the level that pictures of this size give their features at: the coarsest one that
/// still has 32 cells on the shorter side, but at least 1/4. 128 pixels: 1 (stride 4); 256: 2 (stride 8).
int pyramid_level(std::int64_t height, std::int64_t width);

/// Lateral 1 x 1 convolutions, top-down sums with nearest upsampling, a 3 x 3 convolution over the level in
/// use. Of the trunk's taps the stem is not used, so it has no lateral. Parts of the levels that the pictures
/// in use do not ask for get no gradient.
class ClipPyramidImpl : public torch::nn::Module {
 public:
  /// tap_channels: of each of the five taps (ClipResNet::tap_channels).
  ClipPyramidImpl(const std::vector<std::int64_t>& tap_channels, std::int64_t channels);
  /// Feature map [N, C, h, w] at taps[level], level 1 … 4. Throws std::invalid_argument for another level or
  /// taps whose channels differ.
  torch::Tensor forward(const ClipTaps& taps, int level);

 private:
  std::vector<torch::nn::Conv2d> lateral_, smooth_;  ///< of levels 1 … 4
};
TORCH_MODULE(ClipPyramid);

}  // namespace flowscope
