// Vectors of W floats in the compiler's own vector extension: one source, compiled once per instruction set.
// Everything is a template of the width, and no library function is called, so that no code compiled for a
// newer processor can be linked into the paths of an older one.
#pragma once

#include <cstdint>

namespace flowscope {

template <int W>
struct VectorOf;
template <>
struct VectorOf<4> {
  using Float __attribute__((vector_size(16))) = float;
  using Int __attribute__((vector_size(16))) = std::int32_t;
};
template <>
struct VectorOf<8> {
  using Float __attribute__((vector_size(32))) = float;
  using Int __attribute__((vector_size(32))) = std::int32_t;
};
template <>
struct VectorOf<16> {
  using Float __attribute__((vector_size(64))) = float;
  using Int __attribute__((vector_size(64))) = std::int32_t;
};

template <int W>
struct Simd {
  using Float = typename VectorOf<W>::Float;
  using Int = typename VectorOf<W>::Int;
  static constexpr float kLog2E = 1.44269504088896f, kLn2 = 0.693147180559945f;

  static Float load(const float* from) {
    Float value;
    __builtin_memcpy(&value, from, sizeof value);
    return value;
  }
  /// The first `lanes` (at most W) floats; the others are zero.
  static Float load(const float* from, int lanes) {
    if (lanes == W) return load(from);
    Float value{};
    for (int i = 0; i < lanes; ++i) value[i] = from[i];
    return value;
  }
  static void store(float* to, Float value) { __builtin_memcpy(to, &value, sizeof value); }
  static void store(float* to, Float value, int lanes) {
    if (lanes == W) return store(to, value);
    for (int i = 0; i < lanes; ++i) to[i] = value[i];
  }
  static Float fill(float value) { return value - Float{}; }
  static Float max(Float a, Float b) { return a > b ? a : b; }
  static Float min(Float a, Float b) { return a < b ? a : b; }

  /// 2^x for x <= 127, relative error below 2e-7; below -126 the smallest normal number.
  static Float exp2(Float x) {
    const Float bounded = max(x, fill(-126.f));
    constexpr float kRounder =
        12582912.f;  // 1.5 * 2^23: adding it leaves the nearest integer in the low bits
    const Float rounded = bounded + kRounder;
    const Float f = bounded - (rounded - kRounder);  // in [-1/2, 1/2]
    Float p = f * 0.0013264739f + 0.00967151672f;    // minimax polynomial of 2^f
    p = p * f + 0.0555073358f;
    p = p * f + 0.240222424f;
    p = p * f + 0.693147004f;
    p = p * f + 1.f;
    return reinterpret_cast<Float>(reinterpret_cast<Int>(p) + (reinterpret_cast<Int>(rounded) << 23));
  }
  static Float sigmoid(Float x) { return 1.f / (1.f + exp2(min(x * -kLog2E, fill(126.f)))); }
  /// Always in the same order.
  static float sum(Float value) {
    float total = 0;
    for (int i = 0; i < W; ++i) total += value[i];
    return total;
  }
};

}  // namespace flowscope
