#include "policy/plain_scan.h"

#include <vector>

namespace flowscope {

ScanResult plain_scan(const ScanArguments& a) {
  torch::Tensor h = a.h0;
  if (!h.defined()) h = torch::zeros({a.u.size(0), a.u.size(2), a.A.size(1)}, a.u.options());
  std::vector<torch::Tensor> y;
  for (std::int64_t l = 0; l < a.u.size(1); ++l) {
    const torch::Tensor u = a.u.select(1, l), delta = a.delta.select(1, l);
    h = torch::exp(delta.unsqueeze(2) * a.A) * h + (delta * u).unsqueeze(2) * a.B.select(1, l).unsqueeze(1);
    y.push_back((a.C.select(1, l).unsqueeze(1) * h).sum(2) + a.D * u);
  }
  const torch::Tensor stacked = torch::stack(y, 1);
  return {a.z.defined() ? stacked * torch::silu(a.z) : stacked, h};
}

}  // namespace flowscope
