#include "policy/attention.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

namespace flowscope {
namespace {

using torch::autograd::AutogradContext;
using torch::autograd::tensor_list;

/// Query rows per pass.
std::int64_t rows_of(const torch::Tensor& q, const torch::Tensor& k, std::int64_t block) {
  return std::clamp<std::int64_t>(block / std::max<std::int64_t>(q.size(0) * q.size(1) * k.size(2), 1), 1,
                                  std::max<std::int64_t>(q.size(2), 1));
}

torch::Tensor weights_of(const torch::Tensor& q, const torch::Tensor& k) {
  const double scale = 1 / std::sqrt(static_cast<double>(q.size(3)));
  return torch::softmax(torch::matmul(q * scale, k.transpose(2, 3)), -1);
}

class Attention : public torch::autograd::Function<Attention> {
 public:
  static torch::Tensor forward(AutogradContext* context, const torch::Tensor& q, const torch::Tensor& k,
                               const torch::Tensor& v, std::int64_t block) {
    context->save_for_backward({q, k, v});
    context->saved_data["block"] = block;
    const std::int64_t rows = rows_of(q, k, block), length = q.size(2);
    if (rows >= length) return torch::matmul(weights_of(q, k), v);
    torch::Tensor out = torch::empty_like(q, torch::MemoryFormat::Contiguous);
    for (std::int64_t at = 0; at < length; at += rows) {
      const std::int64_t n = std::min(rows, length - at);
      out.narrow(2, at, n).copy_(torch::matmul(weights_of(q.narrow(2, at, n), k), v));
    }
    return out;
  }

  static tensor_list backward(AutogradContext* context, const tensor_list& gradients) {
    const auto saved = context->get_saved_variables();
    const torch::Tensor &q = saved[0], &k = saved[1], &v = saved[2], &d_out = gradients[0];
    const std::int64_t rows = rows_of(q, k, context->saved_data["block"].toInt()), length = q.size(2);
    const double scale = 1 / std::sqrt(static_cast<double>(q.size(3)));
    const auto contiguous = torch::MemoryFormat::Contiguous;
    torch::Tensor d_q = torch::empty_like(q, contiguous), d_k = torch::zeros_like(k, contiguous),
                  d_v = torch::zeros_like(v, contiguous);
    for (std::int64_t at = 0; at < length; at += rows) {
      const std::int64_t n = std::min(rows, length - at);
      const torch::Tensor part = q.narrow(2, at, n), d = d_out.narrow(2, at, n);
      const torch::Tensor p = weights_of(part, k);
      d_v += torch::matmul(p.transpose(2, 3), d);
      const torch::Tensor d_p = torch::matmul(d, v.transpose(2, 3));
      const torch::Tensor d_scores = p * (d_p - (d_p * p).sum(-1, true)) * scale;
      d_q.narrow(2, at, n).copy_(torch::matmul(d_scores, k));
      d_k += torch::matmul(d_scores.transpose(2, 3), part);
    }
    return {d_q, d_k, d_v, torch::Tensor()};
  }
};

}  // namespace

torch::Tensor attention(const torch::Tensor& q, const torch::Tensor& k, const torch::Tensor& v,
                        std::int64_t block) {
  if (q.dim() != 4 || k.dim() != 4 || k.sizes() != v.sizes() || q.size(0) != k.size(0) ||
      q.size(1) != k.size(1) || q.size(3) != k.size(3) || k.size(2) < 1)
    throw std::invalid_argument("attention: q must be [B, H, L, D], k and v [B, H, S, D] with S > 0");
  return Attention::apply(q, k, v, block);
}

}  // namespace flowscope
