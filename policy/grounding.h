// The grounded form of the prediction: the end point rests on points of the scene.
#pragma once

#include <torch/torch.h>

#include "policy/rotation6.h"

namespace flowscope {

/// Each head h points at a place a_h = Σ_i w_hi q_i of the cloud (region, semantic and past tool positions),
/// after choosing the word that it looks for: c_h = softmax over words, w_h = softmax_i(query_h · key_i - Σ_w
/// c_hw mismatch_iw). Position: Σ_h γ_h a_h + Σ_b β_b e_b + offset. Rotation columns: Σ_b α_b e_b +
/// constants. The directions e_b turn with the scene (tool axes, differences of anchors, pointed-at normals,
/// yaws of squares and bars), so a yaw that was learned at one place holds at every other.
class GroundingImpl : public torch::nn::Module {
 public:
  GroundingImpl(int channels, int heads);

  struct Points {
    torch::Tensor token;     ///< [B, P, C]
    torch::Tensor position;  ///< [B, P, 3] metres, world: the middle of what the point belongs to
    torch::Tensor normal;    ///< [B, P, 3] world; zero where there is none
    torch::Tensor moments;   ///< [B, P, 4] square and bar moments of what it belongs to (Surroundings)
    torch::Tensor mismatch;  ///< [B, P, W] colour of the point against each word's
  };
  struct Result {
    torch::Tensor end_point;  ///< [B, 9] normalised
    torch::Tensor weights;    ///< [B, P], sums to 1: what the position rests on
  };
  /// action [B, C]; intent [B, C] chooses among the words' roles [B, W, C], is_word [B, W] 0/1; tool_axes [B,
  /// 3, 3] rows are axes.
  Result forward(const torch::Tensor& action, const torch::Tensor& intent, const Points& points,
                 const torch::Tensor& roles, const torch::Tensor& is_word, const torch::Tensor& tool_axes,
                 const PositionScale& scale);

 private:
  int heads_, key_size_ = 16;
  torch::nn::Linear key_{nullptr}, word_key_{nullptr}, word_query_{nullptr}, mix_{nullptr}, read_{nullptr};
  torch::nn::Sequential query_{nullptr};
};
TORCH_MODULE(Grounding);

}  // namespace flowscope
