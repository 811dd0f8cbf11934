#include "policy/packed_layer.h"

#include <algorithm>

namespace flowscope {

PackedLayer::PackedLayer(const MambaKernels& kernels, const torch::Tensor& weight, const torch::Tensor& bias)
    : kernels_(kernels), inputs_(weight.size(1)), outputs_(weight.size(0)), biased_(bias.defined()) {
  const torch::Tensor dense = weight.contiguous();
  weight_.reserve(kernels.packed_floats(inputs_, outputs_));
  kernels.pack(dense.data_ptr<float>(), inputs_, outputs_, weight_.data());
  if (!biased_) return;
  const torch::Tensor dense_bias = bias.contiguous();
  bias_.reserve(outputs_);
  std::copy_n(dense_bias.data_ptr<float>(), outputs_, bias_.data());
}

void PackedLayer::apply(std::int64_t rows, Rows x, float* y, bool add) const {
  if (biased_) {
    for (std::int64_t r = 0; r < rows; ++r) {
      float* to = y + r * outputs_;
      for (std::int64_t c = 0; c < outputs_; ++c) to[c] = (add ? to[c] : 0.f) + bias_.data()[c];
    }
  }
  kernels_.multiply({rows, inputs_, outputs_, x, weight_.data(), y, outputs_, add || biased_});
}

bool plain_arrays(const torch::Tensor& x, const torch::Tensor& weight) {
  const auto plain = [](const torch::Tensor& t) {
    return t.device().is_cpu() && t.scalar_type() == torch::kFloat32;
  };
  return !torch::GradMode::is_enabled() && plain(x) && plain(weight);
}

}  // namespace flowscope
