// The image branch with CLIP's frozen trunk: pictures of any number of cameras, and the pixels in them that
// tokens stand for (those of scene points, scene_points.h), to one feature per token (paper §3.3).
#pragma once

#include <memory>

#include "policy/clip/pyramid.h"
#include "policy/clip/resnet.h"
#include "policy/torch_parts.h"

namespace flowscope {

/// Rows of `maps` [S V, C, h, w] under `place` [S, M, 3] = (view, x, y), x and y in pixels of pictures of
/// height H and width W, pixel centres at integer + 0.5: bilinear between the four nearest cell centres, held
/// at the border. [S, M, C]. Throws std::invalid_argument for shapes that do not fit and for a view outside 0
/// … V-1.
torch::Tensor gather_features(const torch::Tensor& maps, const torch::Tensor& place, std::int64_t height,
                              std::int64_t width);

/// Owned by one thread at a time, like every module.
class ClipImageBranchImpl : public torch::nn::Module {
 public:
  /// The trunk is shared and stays frozen; only the pyramid's weights are parameters of this module.
  ClipImageBranchImpl(std::shared_ptr<const ClipResNet> trunk, std::int64_t channels);

  /// pictures float32 [S V, 3, H, W], RGB in [0, 1], scene-major, the same cameras V in every scene; place
  /// float32 [S, M, 3]. Gives [S, M, C]; gradients reach the pyramid's weights alone.
  torch::Tensor forward(const torch::Tensor& pictures, const torch::Tensor& place);
  /// The same from what the trunk gave before, which does not change while the pyramid learns.
  torch::Tensor from_taps(const ClipTaps& taps, const torch::Tensor& place);

  const ClipResNet& trunk() const { return *trunk_; }

 private:
  std::shared_ptr<const ClipResNet> trunk_;
  ClipPyramid pyramid_{nullptr};
};
TORCH_MODULE(ClipImageBranch);

}  // namespace flowscope
