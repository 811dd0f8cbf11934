// Points become tokens, W channels or words at a time. Included once per instruction set, by
// policy/token_kernels_*.cc.
#pragma once

#include "policy/simd.h"
#include "policy/token_kernels.h"

namespace flowscope {

template <int W, auto function>
void each_number(const float* x, float* y, std::int64_t count) {
  using S = Simd<W>;
  for (std::int64_t i = 0; i < count; i += W) {
    const auto lanes = S::block_lanes(count, i);
    S::store(y + i, function(S::load(x + i, lanes)), lanes);
  }
}

template <int W>
void gelu_in_place(float* x, std::int64_t count) {
  each_number<W, Simd<W>::gelu>(x, x, count);
}

template <int W, auto slope>
void each_gradient(const float* x, const float* dy, float* dx, std::int64_t count) {
  using S = Simd<W>;
  for (std::int64_t i = 0; i < count; i += W) {
    const auto lanes = S::block_lanes(count, i);
    S::store(dx + i, S::load(dy + i, lanes) * slope(S::load(x + i, lanes)), lanes);
  }
}

template <int W>
void gather_members(const MemberArguments& a) {
  using S = Simd<W>;
  const std::int64_t channels = a.shape.channels, size = a.shape.size;
  for (std::int64_t g = 0; g < a.shape.groups; ++g) {
    for (std::int64_t c = 0; c < channels; c += W) {
      const auto lanes = S::block_lanes(channels, c);
      const auto x = S::load(a.place + c, lanes), y = S::load(a.place + channels + c, lanes),
                 z = S::load(a.place + 2 * channels + c, lanes);
      auto top = S::fill(-3e38f);
      for (std::int64_t row = g * size; row < (g + 1) * size; ++row) {
        const float* r = a.relative + 3 * row;
        const auto h =
            S::gelu(S::load(a.token.row(a.neighbour[row]) + c, lanes) + (r[0] * x + r[1] * y + r[2] * z));
        S::store(a.h + row * channels + c, h, lanes);
        top = S::max(top, h);
      }
      S::store(a.top + g * channels + c, top, lanes);
    }
  }
}

template <int W>
void pool_members(const PooledArguments& a) {
  using S = Simd<W>;
  const std::int64_t channels = a.shape.channels, size = a.shape.size;
  for (std::int64_t g = 0; g < a.shape.groups; ++g) {
    for (std::int64_t c = 0; c < channels; c += W) {
      const auto lanes = S::block_lanes(channels, c);
      const auto pooled = S::load(a.pooled + g * channels + c, lanes);
      auto top = S::fill(-3e38f);
      for (std::int64_t row = g * size; row < (g + 1) * size; ++row)
        top = S::max(top, S::gelu(S::load(a.u + row * channels + c, lanes) + pooled));
      S::store(a.top + g * channels + c, top, lanes);
    }
  }
}

struct ColorAndHue {
  float color[3], hue[3];
};

/// As policy/point_tokens.cc takes the brightness off.
template <int W>
ColorAndHue with_hue(const float* rgb) {
  ColorAndHue out;
  const float mean = (rgb[0] + rgb[1] + rgb[2]) * (1.f / 3.f);
  float squares = 0;
  for (int k = 0; k < 3; ++k) {
    out.color[k] = rgb[k];
    out.hue[k] = rgb[k] - mean;
    squares += out.hue[k] * out.hue[k];
  }
  const float factor = 1.f / (__builtin_sqrtf(squares) + 0.1f);
  for (float& h : out.hue) h *= factor;
  return out;
}

template <int W>
void color_likeness(const LikenessArguments& a) {
  using S = Simd<W>;
  using Float = typename S::Float;
  const ColorWords& w = a.words;
  const auto least = [](Float x, float bound) { return -S::max(-x, S::fill(-bound)); };
  const auto distance2 = [](const float* point, const float* const* word, std::int64_t i, auto lanes) {
    const Float x = S::load(word[0] + i, lanes) - point[0], y = S::load(word[1] + i, lanes) - point[1],
                z = S::load(word[2] + i, lanes) - point[2];
    return x * x + y * y + z * z;
  };
  for (std::int64_t row = 0; row < a.rows; ++row) {
    const ColorAndHue point = with_hue<W>(a.color + 3 * row);
    const std::int64_t at = row * w.words;
    for (std::int64_t i = 0; i < w.words; i += W) {
      const auto lanes = S::block_lanes(w.words, i);
      const Float color2 = distance2(point.color, w.color, i, lanes);
      const Float hue2 = distance2(point.hue, w.hue, i, lanes), mask = S::load(w.is_color + i, lanes);
      const Float near = S::exp2(color2 * (-w.sharp * S::kLog2E)) * mask;
      S::store(a.near + at + i, near, lanes);
      S::store(a.alike + at + i, near * S::exp2(hue2 * (-w.wide * S::kLog2E)), lanes);
      S::store(
          a.mismatch + at + i,
          (w.color_strictness * least(color2, w.farthest2) + w.hue_strictness * least(hue2, w.farthest2)) *
              mask,
          lanes);
    }
  }
}

template <int W>
void attend_words(float* x, std::int64_t rows, std::int64_t words, float scale, const float* bias,
                  const float* is_word) {
  using S = Simd<W>;
  using Float = typename S::Float;
  for (std::int64_t row = 0; row < rows; ++row, x += words) {
    Float most = S::fill(-3e38f), sum{};
    for (std::int64_t i = 0; i < words; i += W) {
      const auto lanes = S::block_lanes(words, i);
      const Float mask = S::load(is_word + i, lanes);
      // Lanes beyond the words have no mask either.
      const Float score =
          mask * (scale * S::load(x + i, lanes) + S::load(bias + i, lanes)) + (mask - 1.f) * 1e9f;
      S::store(x + i, score, lanes);
      most = S::max(most, score);
    }
    const float greatest = S::greatest(most);
    for (std::int64_t i = 0; i < words; i += W) {
      const auto lanes = S::block_lanes(words, i);
      const Float e = S::only(S::exp2((S::load(x + i, lanes) - greatest) * S::kLog2E), lanes);
      S::store(x + i, e, lanes);
      sum += e;
    }
    const float share = 1.f / S::sum(sum);
    for (std::int64_t i = 0; i < words; i += W) {
      const auto lanes = S::block_lanes(words, i);
      S::store(x + i, S::load(x + i, lanes) * share, lanes);
    }
  }
}

template <int W>
constexpr TokenKernels token_kernels_of_width(const char* name) {
  return {.name = name,
          .gelu = gelu_in_place<W>,
          .gelu_of = each_number<W, Simd<W>::gelu>,
          .gelu_gradient = each_gradient<W, Simd<W>::gelu_slope>,
          .softplus_of = each_number<W, Simd<W>::softplus>,
          .softplus_gradient = each_gradient<W, Simd<W>::sigmoid>,
          .members = gather_members<W>,
          .pooled = pool_members<W>,
          .likeness = color_likeness<W>,
          .attend = attend_words<W>};
}

}  // namespace flowscope
