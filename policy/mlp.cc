#include "policy/mlp.h"

#include <ATen/Parallel.h>

#include "policy/flush_denormals.h"
#include "policy/packed_layer.h"
#include "policy/pointwise.h"
#include "policy/token_kernels.h"

namespace flowscope {

MlpImpl::MlpImpl(int in, int channels, int out)
    : first_(register_module("0", torch::nn::Linear(in, channels))),
      second_(register_module("2", torch::nn::Linear(channels, out))) {}

torch::Tensor MlpImpl::forward(const torch::Tensor& x) {
  if (path_ == ScanPath::fused && plain_arrays(x, first_->weight)) return run_fused(x);
  return second_(gelu_of(first_(x)));
}

torch::Tensor MlpImpl::run_fused(const torch::Tensor& x) const {
  constexpr std::int64_t kRows = 128;  // at a time, so that what is between stays in the cache
  const MambaKernels& kernels = *supported_mamba_kernels().front();
  const TokenKernels& token_kernels = *supported_token_kernels().front();
  const PackedLayer first(kernels, first_->weight, first_->bias),
      second(kernels, second_->weight, second_->bias);
  const torch::Tensor from = x.contiguous();
  std::vector<std::int64_t> shape = x.sizes().vec();
  const std::int64_t in = shape.back(), channels = first.outputs(), out = second.outputs();
  shape.back() = out;
  const torch::Tensor y = torch::empty(shape);
  const float* const read = from.data_ptr<float>();
  float* const write = y.data_ptr<float>();
  at::parallel_for(0, y.numel() / out, kRows, [&](std::int64_t begin, std::int64_t end) {
    const FlushDenormals flush;
    AlignedFloats h;
    h.reserve(kRows * channels);
    for (std::int64_t row = begin; row < end; row += kRows) {
      const std::int64_t rows = std::min(kRows, end - row);
      first.apply(rows, {read + row * in, in}, h.data());
      token_kernels.gelu(h.data(), rows * channels);
      second.apply(rows, {h.data(), channels}, write + row * out);
    }
  });
  return y;
}

}  // namespace flowscope
