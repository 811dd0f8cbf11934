#include "policy/selective_scan.h"

#include <vector>

namespace flowscope {

torch::Tensor selective_scan(const torch::Tensor& u, const torch::Tensor& delta, const torch::Tensor& A,
                             const torch::Tensor& B, const torch::Tensor& C, const torch::Tensor& D,
                             const torch::Tensor& z, const torch::Tensor& h0) {
  torch::Tensor h = h0.defined() ? h0 : torch::zeros({u.size(0), u.size(2), A.size(1)}, u.options());
  std::vector<torch::Tensor> y;
  for (std::int64_t l = 0; l < u.size(1); ++l) {
    const auto u_l = u.select(1, l), delta_l = delta.select(1, l);
    h = torch::exp(delta_l.unsqueeze(2) * A) * h + (delta_l * u_l).unsqueeze(2) * B.select(1, l).unsqueeze(1);
    y.push_back((C.select(1, l).unsqueeze(1) * h).sum(2) + D * u_l);
  }
  const torch::Tensor stacked = torch::stack(y, 1);
  return z.defined() ? stacked * torch::silu(z) : stacked;
}

}  // namespace flowscope
