// A linear layer's weights in the product kernel's layout.
#pragma once

#include "policy/aligned_floats.h"
#include "policy/mamba_kernels.h"
#include "policy/torch_parts.h"

namespace flowscope {

/// y = W x + b of every row. `apply` may be called from many threads at once.
class PackedLayer {
 public:
  /// weight [outputs, inputs], bias [outputs] or undefined for zeros; their storage is not kept.
  PackedLayer(const MambaKernels& kernels, const torch::Tensor& weight, const torch::Tensor& bias = {});
  std::int64_t outputs() const { return outputs_; }
  /// x [rows, inputs] -> y [rows, outputs]; `add`: onto what y holds.
  void apply(std::int64_t rows, Rows x, float* y, bool add = false) const;

 private:
  const MambaKernels& kernels_;
  std::int64_t inputs_, outputs_;
  AlignedFloats weight_, bias_;
  bool biased_;
};

/// Without gradients and all float32 on the CPU: what the paths over plain arrays ask for.
bool plain_arrays(const torch::Tensor& x, const torch::Tensor& weight);

}  // namespace flowscope
