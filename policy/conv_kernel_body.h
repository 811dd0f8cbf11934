// Causal depthwise convolution followed by SiLU, W channels at a time, forward and backward.
// Included once per instruction set, by policy/mamba_kernels_*.cc.
#pragma once

#include "policy/mamba_kernels.h"
#include "policy/simd.h"

namespace flowscope {

template <int W, int kTaps>
class ConvBody {
  using S = Simd<W>;
  using Float = typename S::Float;
  static constexpr int kCapacity = kTaps > 0 ? kTaps : kMaxConvTaps;

  static int tap_count(const ConvInputs& in) { return kTaps > 0 ? kTaps : static_cast<int>(in.taps); }
  static void shift_in(Float* window, int taps, Float newest) {
    for (int k = 0; k + 1 < taps; ++k) window[k] = window[k + 1];
    window[taps - 1] = newest;
  }
  /// The window as it is before the first token: its last taps - 1 entries are the tail.
  static void load_tail(Float* window, const ConvInputs& in, int taps, std::int64_t item, std::int64_t c,
                        typename S::Lanes lanes) {
    for (int k = 1; k < taps; ++k) {
      const std::int64_t row = item * (taps - 1) + k - 1;
      window[k] = in.tail ? S::load(in.tail + row * in.channels + c, lanes) : Float{};
    }
  }
  static Float dot(const Float* weight, const Float* window, int taps, Float bias) {
    for (int k = 0; k < taps; ++k) bias += weight[k] * window[k];
    return bias;
  }

 public:
  static void forward(const ConvInputs& in, float* y, std::int64_t item) {
    const int taps = tap_count(in);
    for (std::int64_t c = 0; c < in.channels; c += W) {
      const typename S::Lanes lanes = S::block_lanes(in.channels, c);
      Float weight[kCapacity], window[kCapacity] = {};
      for (int k = 0; k < taps; ++k) weight[k] = S::load(in.weight + k * in.channels + c, lanes);
      load_tail(window, in, taps, item, c, lanes);
      const Float bias = S::load(in.bias + c, lanes);
      for (std::int64_t row = item * in.length; row < (item + 1) * in.length; ++row) {
        shift_in(window, taps, S::load(in.x.row(row) + c, lanes));
        const Float sum = dot(weight, window, taps, bias);
        S::store(y + row * in.channels + c, sum * S::sigmoid(sum), lanes);
      }
    }
  }

  /// With p the sum before SiLU: dx[l] = sum_k weight[taps - 1 - k] dp[l + k], dweight[k] = sum_l dp[l] x[l -
  /// taps + 1 + k].
  static void backward(const ConvInputs& in, const ConvGradients& grad, std::int64_t item) {
    const int taps = tap_count(in);
    for (std::int64_t c = 0; c < in.channels; c += W) {
      const typename S::Lanes lanes = S::block_lanes(in.channels, c);
      Float weight[kCapacity], dweight[kCapacity] = {}, window[kCapacity] = {}, later[kCapacity] = {},
                               dbias{};
      for (int k = 0; k < taps; ++k) weight[k] = S::load(in.weight + k * in.channels + c, lanes);
      load_tail(window, in, taps, item, c, lanes);
      const Float bias = S::load(in.bias + c, lanes);
      // dx[l] is complete taps - 1 tokens after l, when `later` holds dp[l .. l + taps - 1].
      for (std::int64_t l = 0; l < in.length + taps - 1; ++l) {
        Float dp{};
        if (l < in.length) {
          const std::int64_t row = item * in.length + l;
          shift_in(window, taps, S::load(in.x.row(row) + c, lanes));
          const Float sum = dot(weight, window, taps, bias), s = S::sigmoid(sum);
          dp = S::load(grad.dy + row * in.channels + c, lanes) * (s * (1.f + sum * (1.f - s)));
          dbias += dp;
          for (int k = 0; k < taps; ++k) dweight[k] += dp * window[k];
        }
        shift_in(later, taps, dp);
        Float dx{};
        for (int k = 0; k < taps; ++k) dx += weight[taps - 1 - k] * later[k];
        if (l >= taps - 1) {
          S::store(grad.dx + (item * in.length + l - taps + 1) * in.channels + c, dx, lanes);
        } else if (grad.dtail) {
          S::store(grad.dtail + (item * (taps - 1) + l) * in.channels + c, dx, lanes);
        }
      }
      for (int k = 0; k < taps; ++k) {
        S::store(grad.dweight + (item * taps + k) * in.channels + c, dweight[k], lanes);
      }
      S::store(grad.dbias + item * in.channels + c, dbias, lanes);
    }
  }
};

template <int W>
void conv_forward(const ConvInputs& in, float* y, std::int64_t item) {
  if (in.taps == 4) return ConvBody<W, 4>::forward(in, y, item);
  ConvBody<W, 0>::forward(in, y, item);
}

template <int W>
void conv_backward(const ConvInputs& in, const ConvGradients& grad, std::int64_t item) {
  if (in.taps == 4) return ConvBody<W, 4>::backward(in, grad, item);
  ConvBody<W, 0>::backward(in, grad, item);
}

}  // namespace flowscope
