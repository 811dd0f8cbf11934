// The selective scan written down as its two equations: slow, readable, differentiated by torch itself.
#pragma once

#include <torch/torch.h>

#include <vector>

namespace flowscope {

/// Same meaning and shapes as selective_scan (policy/selective_scan.h), in any floating-point type.
inline torch::Tensor selective_scan_reference(const torch::Tensor& u, const torch::Tensor& delta,
                                              const torch::Tensor& A, const torch::Tensor& B,
                                              const torch::Tensor& C, const torch::Tensor& D,
                                              const torch::Tensor& z = {}, const torch::Tensor& h0 = {}) {
  const auto batch = u.size(0), length = u.size(1), channels = u.size(2), states = A.size(1);
  torch::Tensor h = h0.defined() ? h0 : torch::zeros({batch, channels, states}, u.options());
  std::vector<torch::Tensor> y;
  for (std::int64_t l = 0; l < length; ++l) {
    const auto u_l = u.select(1, l), delta_l = delta.select(1, l);                    // [batch, channels]
    const auto B_l = B.select(1, l).unsqueeze(1), C_l = C.select(1, l).unsqueeze(1);  // [batch, 1, states]
    h = torch::exp(delta_l.unsqueeze(2) * A) * h + (delta_l * u_l).unsqueeze(2) * B_l;
    y.push_back((C_l * h).sum(2) + D * u_l);
  }
  const torch::Tensor stacked = torch::stack(y, 1);
  return z.defined() ? stacked * torch::silu(z) : stacked;
}

}  // namespace flowscope
