// Scaled dot-product attention whose memory grows linearly in the tokens.
#pragma once

#include "policy/torch_parts.h"

namespace flowscope {

/// softmax(q kᵀ / √D) v (Vaswani et al. 2017, arXiv 1706.03762, eq. 1): q [B, H, L, D], k and v [B, H, S, D],
/// every query sees every key. A block of query rows at a time holds its [rows, S] scores, about `block`
/// numbers over batch and heads; the backward pass computes them again instead of keeping them (Rabe and
/// Staats 2021, arXiv 2112.05682). Differentiable once in all three. Throws std::invalid_argument for shapes
/// that do not fit.
torch::Tensor attention(const torch::Tensor& q, const torch::Tensor& k, const torch::Tensor& v,
                        std::int64_t block = std::int64_t{1} << 20);

}  // namespace flowscope
