// The selective state-space scan as one fused operator with its own backward pass (Mamba, arXiv 2312.00752).
#pragma once

#include <torch/torch.h>

namespace flowscope {

/// h[l] = exp(delta[l] A) h[l-1] + delta[l] B[l] u[l];  y[l] = C[l] h[l] + D u[l]; returned y * silu(z).
/// B's factor is the Euler form that the published Mamba code uses, not the zero-order hold of the paper's equation.
/// Shapes, all float32 and contiguous: u, delta, z [batch, length, channels]; A [channels, states], negative;
/// B, C [batch, length, states]; D [channels]. delta is after softplus. z may be undefined (no gate).
/// h0 [batch, channels, states] may be undefined (zeros). Differentiable in every tensor but h0.
/// Vectorised for AVX-512 and AVX2 (chosen at run time), parallel over batch; bit-equal for any thread count.
torch::Tensor selective_scan(const torch::Tensor& u, const torch::Tensor& delta, const torch::Tensor& A,
                             const torch::Tensor& B, const torch::Tensor& C, const torch::Tensor& D,
                             const torch::Tensor& z = {}, const torch::Tensor& h0 = {});

}  // namespace flowscope
