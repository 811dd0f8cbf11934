// Matrix products of a linear layer on plain arrays: weights packed once per call, then tiles of rows whose
// sums stay in registers (the scheme of Goto and van de Geijn, doi:10.1145/1356052.1356053, for weights that
// fit the cache whole). Included once per instruction set, by policy/mamba_kernels_*.cc.
#pragma once

#include "policy/mamba_kernels.h"
#include "policy/simd.h"

namespace flowscope {

template <int W>
class ProductBody {
  using S = Simd<W>;
  using Float = typename S::Float;
  using Int = typename S::Int;
  using Lanes = typename S::Lanes;
  /// A tile's sums fill the registers: 8 x 3 of AVX-512's 32, 4 x 3 of the 16 elsewhere.
  static constexpr int kRows = W == 16 ? 8 : 4, kVectors = 3;

  /// kRowCount rows times kCount vectors of outputs.
  template <int kRowCount, int kCount>
  [[gnu::always_inline]] static void tile(const ProductArguments& p, std::int64_t row, std::int64_t output,
                                          Lanes last) {
    const float* x = p.x.row(row);
    float* y = p.y + row * p.y_stride + output;
    const float* weight = p.packed + output * p.inputs;
    Float sum[kRowCount][kCount];
#pragma GCC unroll 8
    for (int r = 0; r < kRowCount; ++r) {
#pragma GCC unroll 3
      for (int v = 0; v < kCount; ++v) {
        const Lanes lanes = v + 1 < kCount ? VectorOf<W>::first(W) : last;
        sum[r][v] = p.add ? S::load(y + r * p.y_stride + v * W, lanes) : Float{};
      }
    }
    for (std::int64_t k = 0; k < p.inputs; ++k, weight += kCount * W) {
      Float w[kCount];
#pragma GCC unroll 3
      for (int v = 0; v < kCount; ++v) w[v] = S::load(weight + v * W);
#pragma GCC unroll 8
      for (int r = 0; r < kRowCount; ++r) {
        const Float factor = S::fill(x[r * p.x.stride + k]);
#pragma GCC unroll 3
        for (int v = 0; v < kCount; ++v) sum[r][v] += factor * w[v];
      }
    }
#pragma GCC unroll 8
    for (int r = 0; r < kRowCount; ++r) {
#pragma GCC unroll 3
      for (int v = 0; v < kCount; ++v) {
        const Lanes lanes = v + 1 < kCount ? VectorOf<W>::first(W) : last;
        S::store(y + r * p.y_stride + v * W, sum[r][v], lanes);
      }
    }
  }

  template <int kCount>
  static void panel(const ProductArguments& p, std::int64_t output) {
    const Lanes last = S::block_lanes(p.outputs, output + (kCount - 1) * W);
    std::int64_t row = 0;
    for (; row + kRows <= p.rows; row += kRows) tile<kRows, kCount>(p, row, output, last);
    for (; row + 2 <= p.rows; row += 2) tile<2, kCount>(p, row, output, last);
    for (; row < p.rows; ++row) tile<1, kCount>(p, row, output, last);
  }

  static std::int64_t vectors_at(std::int64_t outputs, std::int64_t output) {
    const std::int64_t left = (outputs - output + W - 1) / W;
    return left < kVectors ? left : kVectors;
  }

  /// Rows become columns, by exchanging ever smaller halves (Eklundh, doi:10.1109/T-C.1972.223584).
  [[gnu::always_inline]] static void transpose(Float (&square)[W]) {
#pragma GCC unroll 4
    for (int half = W / 2; half >= 1; half /= 2) {
      Int low{}, high{};
#pragma GCC unroll 16
      for (int lane = 0; lane < W; ++lane) {
        low[lane] = lane & half ? W + lane - half : lane;
        high[lane] = lane & half ? W + lane : lane + half;
      }
#pragma GCC unroll 16
      for (int row = 0; row < W; ++row) {
        if (row & half) continue;
        const Float a = square[row], b = square[row + half];
        square[row] = __builtin_shuffle(a, b, low);
        square[row + half] = __builtin_shuffle(a, b, high);
      }
    }
  }

  /// W outputs by W inputs, of which `outputs` and `inputs` exist: zeros for the other outputs.
  static void pack_square(const float* from, std::int64_t stride, std::int64_t outputs, std::int64_t inputs,
                          float* to, std::int64_t width) {
    const Lanes lanes = S::block_lanes(inputs, 0);
    Float square[W];
#pragma GCC unroll 16
    for (int o = 0; o < W; ++o) square[o] = o < outputs ? S::load(from + o * stride, lanes) : Float{};
    transpose(square);
    const int count = inputs < W ? static_cast<int>(inputs) : W;
    for (int k = 0; k < count; ++k) S::store(to + k * width, square[k]);
  }

 public:
  /// Panels of up to kVectors vectors, one after the other; in each, all the outputs' weights of an input.
  static void pack(const float* weight, std::int64_t inputs, std::int64_t outputs, float* packed) {
    for (std::int64_t output = 0; output < outputs; output += kVectors * W) {
      const std::int64_t width = vectors_at(outputs, output) * W;
      float* const to = packed + output * inputs;
      for (std::int64_t o = 0; o < width; o += W)
        for (std::int64_t k = 0; k < inputs; k += W)
          pack_square(weight + (output + o) * inputs + k, inputs, outputs - output - o, inputs - k,
                      to + k * width + o, width);
    }
  }

  static void multiply(const ProductArguments& p) {
    for (std::int64_t output = 0; output < p.outputs; output += kVectors * W) {
      const std::int64_t vectors = vectors_at(p.outputs, output);
      if (vectors == 3) panel<3>(p, output);
      if (vectors == 2) panel<2>(p, output);
      if (vectors == 1) panel<1>(p, output);
    }
  }
};

template <int W>
void pack_weight(const float* weight, std::int64_t inputs, std::int64_t outputs, float* packed) {
  ProductBody<W>::pack(weight, inputs, outputs, packed);
}

template <int W>
void multiply(const ProductArguments& arguments) {
  ProductBody<W>::multiply(arguments);
}

}  // namespace flowscope
