// One Mamba block over a few tokens on plain arrays, without autograd: policy/mamba.h's maths on the kernels.
#pragma once

#include "policy/aligned_floats.h"
#include "policy/mamba.h"
#include "policy/mamba_kernels.h"

namespace flowscope {

/// Tokens of one item, and what its block remembers of those before them. All updated in place.
struct FusedTokens {
  std::int64_t rows = 0;
  float* x = nullptr;                              ///< [rows, d_model]
  float* conv_tail = nullptr;                      ///< [d_conv - 1, channels]
  float* h = nullptr;                              ///< [d_state, channels]
  const float *gain = nullptr, *offset = nullptr;  ///< [d_model], the norm's with the condition in them
};

/// A block's weights in the kernels' layout. After read_weights, `run` may be called from many threads at
/// once, each with its own scratch.
class FusedBlock {
 public:
  /// Reads the parameters as they are now; their storage is not kept.
  void read_weights(const MambaKernels& kernels, const MambaOptions& options, const MambaWeights& weights);
  /// condition [items, condition_dim] after its SiLU, or undefined -> gain and offset [items, d_model].
  void read_condition(const MambaKernels& kernels, const MambaWeights& weights,
                      const torch::Tensor& condition, std::int64_t items, float* gain, float* offset);
  /// scratch: scratch_floats(rows).
  void run(const MambaKernels& kernels, const FusedTokens& tokens, float* scratch) const;
  std::int64_t scratch_floats(std::int64_t rows) const;

 private:
  std::int64_t widest() const { return channels_ > d_model_ ? channels_ : d_model_; }

  std::int64_t d_model_ = 0, channels_ = 0, d_state_ = 0, rank_ = 0, taps_ = 0;
  AlignedFloats in_proj_, x_proj_, dt_proj_, out_proj_;  // packed
  AlignedFloats A_;                                      // [d_state, channels]
  AlignedFloats conv_weight_, conv_bias_, dt_bias_, D_;
  AlignedFloats condition_, scale_shift_;  // packed; [2 d_model, items]
};

}  // namespace flowscope
