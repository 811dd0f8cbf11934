// The grounded form of the prediction: the end point rests on points of the scene.
#pragma once

#include <torch/torch.h>

#include "policy/rotation6.h"

namespace flowscope {

/// Each head h points at a place a_h = Σ_i w_hi q_i of the cloud (region, semantic and past tool positions).
/// Position: Σ_h γ_h a_h + Σ_b β_b e_b + offset. Rotation columns: Σ_b α_b e_b + constants. The directions
/// e_b turn with the scene (tool axes, differences of anchors and their perpendiculars, pointed-at normals),
/// so a yaw that was learned at one place holds at every other.
class GroundingImpl : public torch::nn::Module {
 public:
  GroundingImpl(int channels, int heads);

  struct Points {
    torch::Tensor token;     ///< [B, P, C]
    torch::Tensor position;  ///< [B, P, 3] metres, world
    torch::Tensor normal;    ///< [B, P, 3] world; zero where there is none
  };
  struct Result {
    torch::Tensor end_point;  ///< [B, 9] normalised
    torch::Tensor weights;    ///< [B, P], sums to 1: what the position rests on
  };
  /// action [B, C]; tool_axes [B, 3, 3] rows are axes.
  Result forward(const torch::Tensor& action, const Points& points, const torch::Tensor& tool_axes,
                 const PositionScale& scale);

 private:
  int heads_, key_size_ = 16;
  torch::nn::Linear key_{nullptr}, mix_{nullptr}, read_{nullptr};
  torch::nn::Sequential query_{nullptr};
};
TORCH_MODULE(Grounding);

}  // namespace flowscope
