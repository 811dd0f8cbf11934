// Vectors of W floats in the compiler's own vector extension: one source, compiled once per instruction set.
// Everything is a template of the width, and no library function is called, so that no code compiled for a
// newer processor can be linked into the paths of an older one.
#pragma once

#include <cstdint>
#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace flowscope {

/// What the compiler's own operators do not cover: `Lanes` says which of the W floats exist.
template <int W>
struct VectorOf;

template <>
struct VectorOf<4> {
  using Float __attribute__((vector_size(16))) = float;
  using Int __attribute__((vector_size(16))) = std::int32_t;
  using Lanes = int;
  static Lanes first(int count) { return count; }
  static Float load(const float* from, Lanes lanes) {
    Float value{};
    for (int i = 0; i < 4; ++i) {
      if (i < lanes) value[i] = from[i];
    }
    return value;
  }
  static void store(float* to, Float value, Lanes lanes) {
    for (int i = 0; i < 4; ++i) {
      if (i < lanes) to[i] = value[i];
    }
  }
  static Float only(Float value, Lanes lanes) {
    for (int i = 0; i < 4; ++i) {
      if (i >= lanes) value[i] = 0;
    }
    return value;
  }
#if defined(__SSE2__)
  static Float max(Float a, Float b) { return _mm_max_ps(a, b); }
#else
  static Float max(Float a, Float b) { return a > b ? a : b; }
#endif
};

#if defined(__AVX2__)
template <>
struct VectorOf<8> {
  using Float __attribute__((vector_size(32))) = float;
  using Int __attribute__((vector_size(32))) = std::int32_t;
  using Lanes = __m256i;
  static Lanes first(int count) {
    return _mm256_cmpgt_epi32(_mm256_set1_epi32(count), _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7));
  }
  static Float load(const float* from, Lanes lanes) { return _mm256_maskload_ps(from, lanes); }
  static void store(float* to, Float value, Lanes lanes) { _mm256_maskstore_ps(to, lanes, value); }
  static Float only(Float value, Lanes lanes) { return _mm256_and_ps(value, _mm256_castsi256_ps(lanes)); }
  static Float max(Float a, Float b) { return _mm256_max_ps(a, b); }
  static Float rough_reciprocal(Float x) { return _mm256_rcp_ps(x); }
};
#endif

#if defined(__AVX512F__)
template <>
struct VectorOf<16> {
  using Float __attribute__((vector_size(64))) = float;
  using Int __attribute__((vector_size(64))) = std::int32_t;
  using Lanes = __mmask16;
  static Lanes first(int count) { return static_cast<Lanes>((1u << count) - 1u); }
  static Float load(const float* from, Lanes lanes) { return _mm512_maskz_loadu_ps(lanes, from); }
  static void store(float* to, Float value, Lanes lanes) { _mm512_mask_storeu_ps(to, lanes, value); }
  static Float only(Float value, Lanes lanes) { return _mm512_maskz_mov_ps(lanes, value); }
  static Float rough_reciprocal(Float x) { return _mm512_maskz_rcp14_ps(0xffff, x); }
  /// value * 2^exponent, towards zero where that is too small.
  static Float scale(Float value, Float exponent) { return _mm512_maskz_scalef_ps(0xffff, value, exponent); }
  static Float max(Float a, Float b) { return _mm512_maskz_max_ps(0xffff, a, b); }
};
#endif

template <int W>
struct Simd {
  using Float = typename VectorOf<W>::Float;
  using Int = typename VectorOf<W>::Int;
  using Lanes = typename VectorOf<W>::Lanes;
  static constexpr float kLog2E = 1.44269504088896f, kLn2 = 0.693147180559945f;

  /// 1.5 * 2^23: adding it leaves the nearest integer in the low bits.
  static constexpr float kRounder = 12582912.f;

  static Float load(const float* from) {
    Float value;
    __builtin_memcpy(&value, from, sizeof value);
    return value;
  }
  /// The other lanes are zero; memory behind them is not touched.
  static Float load(const float* from, Lanes lanes) { return VectorOf<W>::load(from, lanes); }
  static void store(float* to, Float value) { __builtin_memcpy(to, &value, sizeof value); }
  static void store(float* to, Float value, Lanes lanes) { VectorOf<W>::store(to, value, lanes); }
  /// Those of a block that begins at channel `first` of `channels`.
  static Lanes block_lanes(std::int64_t channels, std::int64_t first) {
    const std::int64_t left = channels - first;
    return VectorOf<W>::first(left < W ? static_cast<int>(left) : W);
  }
  /// The other lanes become zero.
  static Float only(Float value, Lanes lanes) { return VectorOf<W>::only(value, lanes); }
  static Float fill(float value) { return value - Float{}; }
  /// Where a or b is not a number: b.
  static Float max(Float a, Float b) { return VectorOf<W>::max(a, b); }

  /// 2^f for f in [-1/2, 1/2]: a minimax polynomial.
  static Float exp2_of_fraction(Float f) {
    Float p = f * 0.0013264739f + 0.00967151672f;
    p = p * f + 0.0555073358f;
    p = p * f + 0.240222424f;
    p = p * f + 0.693147004f;
    return p * f + 1.f;
  }
  /// 2^(a b) for a b <= 127, relative error below 2e-7; from -126 down anything up to the smallest normal.
  static Float exp2_of_product(Float a, Float b) {
    if constexpr (W == 16) {
      const Float whole = (a * b + kRounder) - kRounder;
      return VectorOf<W>::scale(exp2_of_fraction(a * b - whole), whole);
    } else {
      return exp2(a * b);
    }
  }
  /// 2^x for x <= 127, relative error below 2e-7; below -126 the smallest normal number.
  static Float exp2(Float x) {
    const Float bounded = max(fill(-126.f), x);
    const Float rounded = bounded + kRounder;
    const Float p = exp2_of_fraction(bounded - (rounded - kRounder));
    return reinterpret_cast<Float>(reinterpret_cast<Int>(p) + (reinterpret_cast<Int>(rounded) << 23));
  }
  /// 1 / x for 1 <= x <= 2^126, relative error below 3e-7: a division costs as much as the rest of a gate.
  static Float reciprocal(Float x) {
    if constexpr (W == 4) {
      return 1.f / x;
    } else {
      const Float rough = VectorOf<W>::rough_reciprocal(x);
      return rough * (2.f - x * rough);  // a Newton step
    }
  }
  static Float sigmoid(Float x) { return reciprocal(1.f + exp2(-max(fill(-125.f), x * kLog2E))); }
  /// x Φ(x), Φ the normal distribution: with the error function's approximation 7.1.26 of Abramowitz and
  /// Stegun (absolute error below 2e-7 |x|).
  static Float gelu(Float x) {
    const Float above = max(Float{}, x), size = 2.f * above - x;  // |x|
    return above - size * normal_tail(size, normal_bell(size));
  }
  /// Its derivative Φ(x) + x φ(x), absolute error below 3e-6.
  static Float gelu_slope(Float x) {
    const Float above = max(Float{}, x), size = 2.f * above - x, bell = normal_bell(size);
    const Float tail = normal_tail(size, bell), positive = x > Float{} ? 1.f - tail : tail;
    return positive + x * bell * 0.398942280f;  // 1 / sqrt(2 pi)
  }
  /// exp(-x²/2).
  static Float normal_bell(Float x) { return exp2(max(fill(-126.f), x * x * (-0.5f * kLog2E))); }
  /// 1 - Φ(x) for x >= 0 and its bell.
  static Float normal_tail(Float x, Float bell) {
    const Float t = reciprocal(1.f + x * 0.231641888f);  // 0.3275911 / sqrt(2)
    Float p = t * 1.061405429f - 1.453152027f;
    p = p * t + 1.421413741f;
    p = p * t - 0.284496736f;
    p = p * t + 0.254829592f;
    return 0.5f * p * t * bell;
  }
  /// Always in the same order.
  static float sum(Float value) {
    float total = 0;
    for (int i = 0; i < W; ++i) total += value[i];
    return total;
  }
  static float greatest(Float value) {
    float most = value[0];
    for (int i = 1; i < W; ++i) most = most > value[i] ? most : value[i];
    return most;
  }
  /// log(1 + e^x), relative error below 1e-6 for x >= -87.
  static Float softplus(Float x) {
    const Float above = max(Float{}, x), t = exp2((x - 2.f * above) * kLog2E);  // e^-|x|
    // log(1 + t) = 2 artanh(s): a polynomial of s^2 in [0, 1/9] through the Chebyshev nodes
    const Float s = t * reciprocal(2.f + t), w = s * s;
    Float p = w * 0.281577784f + 0.279651577f;
    p = p * w + 0.400245952f;
    p = p * w + 0.666663216f;
    p = p * w + 2.00000001f;
    return above + s * p;
  }
};

}  // namespace flowscope
