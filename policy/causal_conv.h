// The short convolution in front of the scan, fused with its activation.
#pragma once

#include <torch/torch.h>

namespace flowscope {

struct MambaKernels;

/// y[l] = silu(bias + sum_k weight[k] x[l - taps + 1 + k]) for each channel by itself; tokens before the
/// first are zero. x [batch, length, channels], weight [taps, channels] with at most 8 taps, bias [channels];
/// all float32, x may be a slice of columns. Differentiable (once) in all three; bit-equal for any thread
/// count.
torch::Tensor causal_conv_silu(const torch::Tensor& x, const torch::Tensor& weight,
                               const torch::Tensor& bias);

/// The same on the given kernels instead of the machine's fastest (policy/mamba_kernels.h).
torch::Tensor causal_conv_silu_on(const MambaKernels& kernels, const torch::Tensor& x,
                                  const torch::Tensor& weight, const torch::Tensor& bias);

}  // namespace flowscope
