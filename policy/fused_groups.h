// Groups of points to tokens without autograd: policy/point_encoder.h's maths on the kernels, a few groups at
// a time so that their members stay in the cache.
#pragma once

#include "policy/mamba_kernels.h"
#include "policy/token_kernels.h"
#include "policy/torch_parts.h"

namespace flowscope {

/// The layers' parameters, as policy/point_encoder.h names them: A, P, B, D and E.
struct GroupWeights {
  torch::Tensor token_in, token_in_bias;  ///< [C, C], [C]
  torch::Tensor place_in;                 ///< [C, 3]
  torch::Tensor inner, inner_bias;        ///< [C, C], [C]
  torch::Tensor pooled;                   ///< [C, C]
  torch::Tensor out, out_bias;            ///< [C, C], [C]
};

/// tokens [B, n, C], relative [B, G, k, 3], neighbour [B * G * k] int64 rows of the flattened tokens -> [B,
/// G, C]. Everything on the CPU, no gradients. Bit-equal for any thread count.
torch::Tensor fused_groups(const GroupWeights& weights, const torch::Tensor& tokens,
                           const torch::Tensor& relative, const torch::Tensor& neighbour,
                           const MambaKernels& kernels = *supported_mamba_kernels().front(),
                           const TokenKernels& token_kernels = *supported_token_kernels().front());

}  // namespace flowscope
