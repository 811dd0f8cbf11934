// The selective state-space scan as one fused operator with its own backward pass (Mamba, arXiv 2312.00752).
#pragma once

#include "policy/torch_parts.h"

namespace flowscope {

/// What selective_scan reads, all float32; B is [batch, length, states] with at most 64 states.
struct ScanArguments {
  torch::Tensor u, delta;  ///< [batch, length, channels]; delta after softplus
  torch::Tensor A;         ///< [channels, states], negative
  torch::Tensor B, C;      ///< [batch, length, states]
  torch::Tensor D;         ///< [channels]
  torch::Tensor z{};       ///< [batch, length, channels]; undefined: no gate
  torch::Tensor h0{};      ///< [batch, channels, states], the state before the first token; undefined: zeros
};

struct ScanResult {
  torch::Tensor y;           ///< [batch, length, channels]
  torch::Tensor last_state;  ///< [batch, channels, states], to run on from as h0
};

/// h[l] = exp(delta[l] A) h[l-1] + delta[l] B[l] u[l];  y[l] = C[l] h[l] + D u[l]; returned y * silu(z).
/// B's factor is the Euler form that the published Mamba code uses, not the zero-order hold of the paper's
/// equation. Slices of columns are read in place. Differentiable (once) in every tensor, through both
/// results. std::invalid_argument names the tensor that does not fit. Vectorised for AVX-512 and AVX2 (chosen
/// at run time), parallel over batch; bit-equal for any thread count.
ScanResult selective_scan(const ScanArguments& arguments);

struct MambaKernels;
/// The same on the given kernels instead of the machine's fastest (policy/mamba_kernels.h).
ScanResult selective_scan_on(const MambaKernels& kernels, const ScanArguments& arguments);

}  // namespace flowscope
