// Farthest point sampling for vectors of W floats; included once per instruction set. The bound of a bucket
// is computed by the same operations in the same order as a distance. Rounding keeps order, so the bound is
// never above a distance as computed, and leaving a bucket out changes no number.
#pragma once

#include "policy/point_kernels.h"
#include "policy/simd.h"

namespace flowscope {

template <int W>
struct PointMath {
  using S = Simd<W>;
  using Float = typename S::Float;

  /// Bit i: a < b in lane i.
  static unsigned less(Float a, Float b) {
#if defined(__AVX512F__)
    if constexpr (W == 16) return _mm512_cmp_ps_mask(a, b, _CMP_LT_OQ);
#endif
#if defined(__AVX2__)
    if constexpr (W == 8) return static_cast<unsigned>(_mm256_movemask_ps(_mm256_cmp_ps(a, b, _CMP_LT_OQ)));
#endif
#if defined(__SSE2__)
    if constexpr (W == 4) return static_cast<unsigned>(_mm_movemask_ps(_mm_cmplt_ps(a, b)));
#endif
    unsigned bits = 0;
    for (int i = 0; i < W; ++i) bits |= (a[i] < b[i] ? 1u : 0u) << i;
    return bits;
  }
  static float greatest(Float value) {
    float best = value[0];
    for (int i = 1; i < W; ++i) best = value[i] > best ? value[i] : best;
    return best;
  }
  static Float norm2(Float x, Float y, Float z) { return x * x + (y * y + z * z); }

  /// Between a point and the slots from `at` on.
  static Float distance2(const float* const (&axes)[3], int at, const Float (&q)[3]) {
    return norm2(S::load(axes[0] + at) - q[0], S::load(axes[1] + at) - q[1], S::load(axes[2] + at) - q[2]);
  }
  /// Between a point and the boxes from `at` on.
  static Float bound2(const float* const (&low)[3], const float* const (&high)[3], int at,
                      const Float (&q)[3]) {
    Float d[3];
    for (int a = 0; a < 3; ++a)
      d[a] = S::max(S::max(S::load(low[a] + at) - q[a], q[a] - S::load(high[a] + at)), Float{});
    return norm2(d[0], d[1], d[2]);
  }
};

template <int W, bool tinted>
void lower_buckets(const BucketArrays& b, const float* sample) {
  using M = PointMath<W>;
  using S = Simd<W>;
  using Float = typename S::Float;
  const Float place[3] = {S::fill(sample[0]), S::fill(sample[1]), S::fill(sample[2])};
  Float tint[3] = {}, weight{};
  if constexpr (tinted) {
    for (int a = 0; a < 3; ++a) tint[a] = S::fill(sample[3 + a]);
    weight = S::fill(b.tint_weight);
  }
  for (int k = 0; k < b.buckets; k += W) {
    Float bound = M::bound2(b.place_low, b.place_high, k, place);
    if constexpr (tinted)
      bound = S::load(b.least_salience + k) * (bound + weight * M::bound2(b.tint_low, b.tint_high, k, tint));
    for (unsigned near = M::less(bound, S::load(b.farthest2 + k)); near != 0; near &= near - 1) {
      const int bucket = k + __builtin_ctz(near);
      Float farthest = S::fill(-1.f);
      for (int at = b.first[bucket]; at < b.first[bucket + 1]; at += W) {
        Float d = M::distance2(b.place, at, place);
        if constexpr (tinted) d = S::load(b.salience + at) * (d + weight * M::distance2(b.tint, at, tint));
        const Float before = S::load(b.distance2 + at);
        const Float after = d < before ? d : before;
        S::store(b.distance2 + at, after);
        farthest = S::max(farthest, after);
      }
      b.farthest2[bucket] = M::greatest(farthest);
    }
  }
}

template <int W>
void lower(const BucketArrays& b, const float* sample) {
  if (b.tint[0])
    lower_buckets<W, true>(b, sample);
  else
    lower_buckets<W, false>(b, sample);
}

template <int W>
int farthest(const BucketArrays& b, const int* rank) {
  using M = PointMath<W>;
  using S = Simd<W>;
  using Float = typename S::Float;
  Float best = S::fill(-1.f);
  for (int k = 0; k < b.buckets; k += W) best = S::max(best, S::load(b.farthest2 + k));
  const float greatest = M::greatest(best);
  if (greatest < 0) return -1;
  // Nothing is above the greatest, so what is not below it is equal.
  const Float limit = S::fill(greatest);
  constexpr unsigned all = (1u << W) - 1;
  int chosen = -1;
  for (int k = 0; k < b.buckets; k += W) {
    for (unsigned far = ~M::less(S::load(b.farthest2 + k), limit) & all; far != 0; far &= far - 1) {
      const int bucket = k + __builtin_ctz(far);
      for (int at = b.first[bucket]; at < b.first[bucket + 1]; at += W) {
        for (unsigned hit = ~M::less(S::load(b.distance2 + at), limit) & all; hit != 0; hit &= hit - 1) {
          const int slot = at + __builtin_ctz(hit);
          if (chosen < 0 || rank[slot] < rank[chosen]) chosen = slot;
        }
      }
    }
  }
  return chosen;
}

}  // namespace flowscope
