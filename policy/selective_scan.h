// The selective state-space scan as one fused operator with its own backward pass (Mamba, arXiv 2312.00752).
#pragma once

#include <torch/torch.h>

namespace flowscope {

/// h[l] = exp(delta[l] A) h[l-1] + delta[l] B[l] u[l];  y[l] = C[l] h[l] + D u[l]; returned y * silu(z).
/// B's factor is the Euler form that the published Mamba code uses, not the zero-order hold of the paper's
/// equation. Shapes, all float32: u, delta, z [batch, length, channels]; A [channels, states], negative, at
/// most 64 states; B, C [batch, length, states]; D [channels]. Slices of columns are read in place. delta is
/// after softplus. z may be undefined (no gate). h0 [batch, channels, states] may be undefined (zeros).
/// Differentiable (once) in every tensor but h0. std::invalid_argument names the tensor that does not fit.
/// Vectorised for AVX-512 and AVX2 (chosen at run time), parallel over batch; bit-equal for any thread count.
torch::Tensor selective_scan(const torch::Tensor& u, const torch::Tensor& delta, const torch::Tensor& A,
                             const torch::Tensor& B, const torch::Tensor& C, const torch::Tensor& D,
                             const torch::Tensor& z = {}, const torch::Tensor& h0 = {});

struct ScanArguments {
  torch::Tensor u, delta, A, B, C, D, z, h0;
};
struct MambaKernels;
/// The same on the given kernels instead of the machine's fastest (policy/mamba_kernels.h).
torch::Tensor selective_scan_on(const MambaKernels& kernels, const ScanArguments& arguments);

struct ScanResult {
  torch::Tensor y, last_state;  ///< [batch, length, channels], [batch, channels, states]
};
/// Not differentiable: also returns the state after the last token, to run on from as h0.
ScanResult selective_scan_keeping_state(const ScanArguments& arguments);

}  // namespace flowscope
