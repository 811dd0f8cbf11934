// Layer norm and the activation of the step sizes, W channels at a time.
// Included once per instruction set, by policy/mamba_kernels_*.cc.
#pragma once

#include "policy/mamba_kernels.h"
#include "policy/simd.h"

namespace flowscope {

template <int W>
void layer_norm(const NormArguments& a) {
  using S = Simd<W>;
  using Float = typename S::Float;
  const float share = 1.f / static_cast<float>(a.channels);
  for (std::int64_t row = 0; row < a.rows; ++row) {
    const float* x = a.x + row * a.channels;
    float* y = a.y + row * a.channels;
    Float sum{}, squares{};
    for (std::int64_t c = 0; c < a.channels; c += W) sum += S::load(x + c, S::block_lanes(a.channels, c));
    const float mean = S::sum(sum) * share;
    // A second pass, since the difference of two large sums would lose the small variances.
    for (std::int64_t c = 0; c < a.channels; c += W) {
      const auto lanes = S::block_lanes(a.channels, c);
      const Float off = S::load(x + c, lanes) - S::only(S::fill(mean), lanes);
      squares += off * off;
    }
    const float factor = 1.f / __builtin_sqrtf(S::sum(squares) * share + a.epsilon);
    for (std::int64_t c = 0; c < a.channels; c += W) {
      const auto lanes = S::block_lanes(a.channels, c);
      const Float scaled = (S::load(x + c, lanes) - mean) * factor;
      S::store(y + c, scaled * S::load(a.gain + c, lanes) + S::load(a.offset + c, lanes), lanes);
    }
  }
}

template <int W>
void softplus(float* x, const float* bias, std::int64_t rows, std::int64_t channels) {
  using S = Simd<W>;
  for (std::int64_t row = 0; row < rows; ++row, x += channels) {
    for (std::int64_t c = 0; c < channels; c += W) {
      const auto lanes = S::block_lanes(channels, c);
      S::store(x + c, S::softplus(S::load(x + c, lanes) + S::load(bias + c, lanes)), lanes);
    }
  }
}

}  // namespace flowscope
