// The grounded form of the prediction: the end point rests on points of the scene.
#pragma once

#include <vector>

#include "policy/mlp.h"
#include "policy/rotation6.h"
#include "policy/torch_parts.h"

namespace flowscope {

/// Each head h points at a place a_h = Σ_i w_hi q_i of the cloud (region, semantic and past tool positions),
/// after choosing the word that it looks for: c_h = softmax over words, w_h = softmax_i(query_h · key_i - Σ_w
/// c_hw mismatch_iw). Position: Σ_h γ_h a_h + Σ_b β_b e_b + offset. Rotation columns: Σ_b α_b e_b +
/// constants. The directions e_b turn with the scene (tool axes, differences of anchors, pointed-at normals,
/// yaws of squares and bars), so a yaw that was learned at one place holds at every other.
class GroundingImpl : public torch::nn::Module {
 public:
  GroundingImpl(int channels, int heads);

  /// Some of the points, in R rows: one per draw (R = B), or one per scene (R = S, B a multiple of it, draws
  /// scene-major) where they are the same for all its draws.
  struct Points {
    torch::Tensor token;    ///< [R, P, C]
    torch::Tensor places;   ///< [R, P, 10] as `places` lays them out
    torch::Tensor penalty;  ///< [R, H, P] of `penalty`; undefined: none
  };
  struct Result {
    torch::Tensor end_point;  ///< [B, 9] normalised
    torch::Tensor weights;    ///< [B, P of all parts], sums to 1: what the position rests on
  };
  /// position [R, P, 3] metres, world: the middle of what the point belongs to; normal [R, P, 3] world, zero
  /// where there is none; moments [R, P, 4] square and bar moments of what it belongs to (Surroundings).
  static torch::Tensor places(const torch::Tensor& position, const torch::Tensor& normal,
                              const torch::Tensor& moments);
  /// c_hw: which word each head looks for, [S, H, W]. intent [S, C] chooses among the words' roles [S, W, C],
  /// is_word [S, W] 0/1.
  torch::Tensor seek(const torch::Tensor& intent, const torch::Tensor& roles, const torch::Tensor& is_word);
  /// Σ_w c_hw mismatch_iw as [R, H, P], of sought [R, H, W] and mismatch [R, P, W]: how far each point's
  /// colour is from the word's.
  static torch::Tensor penalty(const torch::Tensor& sought, const torch::Tensor& mismatch);
  /// action [B, C]; tool_axes [B, 3, 3] rows are axes.
  Result forward(const torch::Tensor& action, const std::vector<Points>& parts,
                 const torch::Tensor& tool_axes, const PositionScale& scale);

 private:
  int heads_, key_size_ = 16;
  torch::nn::Linear key_{nullptr}, word_key_{nullptr}, word_query_{nullptr}, mix_{nullptr}, read_{nullptr};
  Mlp query_{nullptr};
};
TORCH_MODULE(Grounding);

}  // namespace flowscope
