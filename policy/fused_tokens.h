// Points to tokens without autograd: policy/point_tokens.h's maths on the kernels, a few points at a time so
// that all that is between stays in the cache.
#pragma once

#include "policy/mamba_kernels.h"
#include "policy/point_tokens.h"
#include "policy/token_kernels.h"
#include "policy/torch_parts.h"

namespace flowscope {

/// The parameters of a PointTokens; without binding only the first three pairs.
struct TokenWeights {
  torch::Tensor in, in_bias;              ///< [C, F], [C]
  torch::Tensor first_out, first_bias;    ///< [C, C], [C]
  torch::Tensor second_out, second_bias;  ///< [C, C], [C]
  torch::Tensor query, query_bias;        ///< [C, C], [C]
  float sharp = 0, wide = 0;              ///< 1 / 2σ²
  float color_strictness = 0, hue_strictness = 0, farthest2 = 0;
};

/// As PointTokensImpl::forward, everything on the CPU, no gradients. `words` without keys: no word is looked
/// at. Bit-equal for any thread count.
BoundTokens fused_tokens(const TokenWeights& weights, const torch::Tensor& features,
                         const torch::Tensor& color, const WordKeys& words, const torch::Tensor& extra,
                         const MambaKernels& kernels = *supported_mamba_kernels().front(),
                         const TokenKernels& token_kernels = *supported_token_kernels().front());

}  // namespace flowscope
