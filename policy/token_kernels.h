// The inner loops that make points into tokens, and functions number by number, on plain arrays, once per
// instruction set. No torch here.
#pragma once

#include <cstdint>
#include <vector>

#include "policy/mamba_kernels.h"

namespace flowscope {

/// Points that stand in groups, `size` to a group: row g * size + j is member j of group g.
struct GroupShape {
  std::int64_t groups = 0, size = 0, channels = 0;
};

/// h = gelu(token of the member + P relative), top = its greatest in each group.
struct MemberArguments {
  GroupShape shape;
  Rows token;                               ///< [points, channels]
  const std::int64_t* neighbour = nullptr;  ///< [groups * size] rows of token
  const float* relative = nullptr;          ///< [groups * size, 3] place in the group
  const float* place = nullptr;             ///< [3, channels], P transposed
  float* h = nullptr;                       ///< [groups * size, channels]
  float* top = nullptr;                     ///< [groups, channels]
};

/// top = the greatest gelu(u + pooled) in each group.
struct PooledArguments {
  GroupShape shape;
  const float* u = nullptr;       ///< [groups * size, channels]
  const float* pooled = nullptr;  ///< [groups, channels]
  float* top = nullptr;           ///< [groups, channels]
};

/// Colour words as the likeness compares points with them.
struct ColorWords {
  std::int64_t words = 0;
  const float *color[3] = {}, *hue[3] = {};  ///< [words] each
  const float* is_color = nullptr;           ///< [words] 0/1
  float sharp = 0, wide = 0;                 ///< 1 / 2σ² of colour and of hue
  float color_strictness = 0, hue_strictness = 0;
  float farthest2 = 0;  ///< distances beyond it count as it
};

/// near = exp(-sharp d²), alike = near exp(-wide e²), mismatch = Σ strictness min(distance², farthest2), with
/// d the distance of colours and e that of hues; all 0 where the word names no colour.
struct LikenessArguments {
  ColorWords words;
  std::int64_t rows = 0;
  const float* color = nullptr;                                  ///< [rows, 3]
  float *near = nullptr, *alike = nullptr, *mismatch = nullptr;  ///< [rows, words]
};

struct TokenKernels {
  const char* name;
  /// x [count] becomes gelu(x), in place.
  void (*gelu)(float* x, std::int64_t count);
  /// y = function(x) or dx = dy function'(x), [count] each; for policy/pointwise.h.
  void (*gelu_of)(const float* x, float* y, std::int64_t count);
  void (*gelu_gradient)(const float* x, const float* dy, float* dx, std::int64_t count);
  void (*softplus_of)(const float* x, float* y, std::int64_t count);
  void (*softplus_gradient)(const float* x, const float* dy, float* dx, std::int64_t count);
  void (*members)(const MemberArguments&);
  void (*pooled)(const PooledArguments&);
  void (*likeness)(const LikenessArguments&);
  /// Each row of x [rows, words] becomes softmax(scale x + bias) over the words with is_word 1; with none,
  /// over all of them alike.
  void (*attend)(float* x, std::int64_t rows, std::int64_t words, float scale, const float* bias,
                 const float* is_word);
};

extern const TokenKernels kPortableTokenKernels, kAvx2TokenKernels, kAvx512TokenKernels;

/// Those that this machine can run, fastest first, as supported_mamba_kernels; never empty.
const std::vector<const TokenKernels*>& supported_token_kernels();

}  // namespace flowscope
