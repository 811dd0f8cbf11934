// The selective scan and its convolution as tensor operations: for devices that the kernels do not run on.
#pragma once

#include "policy/selective_scan.h"

namespace flowscope {

/// Shapes and meaning as in selective_scan.h, on any device; differentiable in every tensor, h0 and the last
/// state included. The tokens of a chunk are scanned together in log2(chunk) rounds (Hillis, Steele 1986,
/// doi:10.1145/7902.7903), so that a long sequence costs few launches. Only the states between chunks are
/// kept; the backward pass computes each chunk again. `chunk` 0: as long as some 64 MiB of states allow.
ScanResult scan_by_tensors(const ScanArguments& arguments, std::int64_t chunk = 0);

/// causal_conv_silu (causal_conv.h) the same way.
torch::Tensor causal_conv_silu_by_tensors(const torch::Tensor& x, const torch::Tensor& weight,
                                          const torch::Tensor& bias, const torch::Tensor& tail = {});

}  // namespace flowscope
