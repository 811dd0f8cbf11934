// Points become tokens, each bound to the words of the instruction before anything is pooled.
#pragma once

#include <torch/torch.h>

namespace flowscope {

struct BoundTokens {
  torch::Tensor token;  ///< [B, P, C]
  torch::Tensor
      mismatch;  ///< [B, P, W] how far the point's colour is from the colour word's; 0 for other words
};

/// token = MLP(features) + Σ_w s(p, w) V w, where s is the likeness of the point's colour to a colour word,
/// exp(-|c_p - c_w|² / 2σ²) at two widths, and for the other words a learned softmax likeness.
class PointTokensImpl : public torch::nn::Module {
 public:
  /// `binding` false: no word is looked at, every mismatch is zero (for the ablation).
  PointTokensImpl(int features, int channels, bool binding = true);
  /// features [B, P, F], color [B, P, 3], words [B, W, C], word_color [B, W, 3], is_color and is_word [B, W]
  /// 0/1, mention [B, W, C] (which of the colour words it is), extra [B, P, C] or undefined.
  BoundTokens forward(const torch::Tensor& features, const torch::Tensor& color, const torch::Tensor& words,
                      const torch::Tensor& word_color, const torch::Tensor& is_color,
                      const torch::Tensor& is_word, const torch::Tensor& mention,
                      const torch::Tensor& extra = {});

 private:
  bool binding_;
  torch::nn::Linear in_{nullptr}, query_{nullptr}, key_{nullptr}, value_{nullptr}, sharp_{nullptr},
      wide_{nullptr};
  torch::nn::Sequential out_{nullptr};
  torch::Tensor log_width_;   ///< [2] log of 1 / 2σ²
  torch::Tensor strictness_;  ///< [2] log weight of colour and of hue in the mismatch
  torch::Tensor gain_;        ///< [1] rendered brightness of a named colour
};
TORCH_MODULE(PointTokens);

}  // namespace flowscope
