// Points become tokens, each bound to the words of the instruction before anything is pooled.
#pragma once

#include "policy/backbone.h"
#include "policy/torch_parts.h"

namespace flowscope {

struct TokenWeights;

struct BoundTokens {
  torch::Tensor token;  ///< [B, P, C]
  torch::Tensor
      mismatch;  ///< [B, P, W] how far the point's colour is from the colour word's; 0 for other words
};

/// An instruction's words as points meet them: once per scene, for all its points and flow steps.
struct WordKeys {
  torch::Tensor key, value;         ///< [S, W, C]
  torch::Tensor sharp, wide;        ///< [S, W, C] what a point of the colour, or of its hue, hears
  torch::Tensor color, hue;         ///< [S, W, 3] as rendered; without brightness
  torch::Tensor is_color, is_word;  ///< [S, 1, W] 0/1
};

/// token = MLP(features) + Σ_w s(p, w) V w, where s is the likeness of the point's colour to a colour word,
/// exp(-|c_p - c_w|² / 2σ²) at two widths, and for the other words a learned softmax likeness.
class PointTokensImpl : public torch::nn::Module {
 public:
  /// `binding` false: no word is looked at, every mismatch is zero (for the ablation).
  PointTokensImpl(int features, int channels, bool binding = true);
  /// words [S, W, C], word_color [S, W, 3], is_color and is_word [S, W] 0/1, mention [S, W, C] (which of the
  /// colour words it is).
  WordKeys read_words(const torch::Tensor& words, const torch::Tensor& word_color,
                      const torch::Tensor& is_color, const torch::Tensor& is_word,
                      const torch::Tensor& mention);
  /// features [S, P, F], color [S, P, 3], extra [S, P, C] or undefined.
  BoundTokens forward(const torch::Tensor& features, const torch::Tensor& color, const WordKeys& words,
                      const torch::Tensor& extra = {});
  /// `fused` where never called: without gradients on the kernels (policy/fused_tokens.h), within 1e-4.
  void run_by(ScanPath path) { path_ = path; }

 private:
  TokenWeights weights() const;
  torch::Tensor read_out(const torch::Tensor& h);

  bool binding_;
  ScanPath path_ = ScanPath::fused;
  torch::nn::Linear in_{nullptr}, query_{nullptr}, key_{nullptr}, value_{nullptr}, sharp_{nullptr},
      wide_{nullptr};
  torch::nn::Sequential out_{nullptr};
  torch::Tensor log_width_;   ///< [2] log of 1 / 2σ²
  torch::Tensor strictness_;  ///< [2] log weight of colour and of hue in the mismatch
  torch::Tensor gain_;        ///< [1] rendered brightness of a named colour
};
TORCH_MODULE(PointTokens);

}  // namespace flowscope
