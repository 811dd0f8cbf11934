// The short convolution in front of the scan, fused with its activation.
#pragma once

#include "policy/torch_parts.h"

namespace flowscope {

struct MambaKernels;

/// y[l] = silu(bias + sum_k weight[k] x[l - taps + 1 + k]) for each channel by itself. x [batch, length,
/// channels], weight [taps, channels] with at most 8 taps, bias [channels]; tail [batch, taps - 1, channels]
/// holds the x before the first token, zeros where it is undefined. All float32, x may be a slice of columns.
/// Differentiable (once) in all four; bit-equal for any thread count.
torch::Tensor causal_conv_silu(const torch::Tensor& x, const torch::Tensor& weight, const torch::Tensor& bias,
                               const torch::Tensor& tail = {});

/// The same on the given kernels instead of the machine's fastest (policy/mamba_kernels.h).
torch::Tensor causal_conv_silu_on(const MambaKernels& kernels, const torch::Tensor& x,
                                  const torch::Tensor& weight, const torch::Tensor& bias,
                                  const torch::Tensor& tail = {});

}  // namespace flowscope
