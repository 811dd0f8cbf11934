#include "policy/scan_by_tensors.h"

#include <algorithm>
#include <vector>

#include "policy/tensor_rows.h"

namespace flowscope {
namespace {

constexpr const char* kName = "scan_by_tensors";

/// For a recurrence, x[l] += a[l] x[l - 1] for every l at once: after the round with distance d each entry
/// stands for the 2 d tokens that end at it.
torch::Tensor scan_recurrence(torch::Tensor a, torch::Tensor x) {
  const std::int64_t length = x.size(1);
  for (std::int64_t d = 1; d < length; d *= 2) {
    const std::int64_t rest = length - d;
    const torch::Tensor later = a.narrow(1, d, rest);
    x = torch::cat({x.narrow(1, 0, d), x.narrow(1, d, rest) + later * x.narrow(1, 0, rest)}, 1);
    if (2 * d < length) a = torch::cat({a.narrow(1, 0, d), later * a.narrow(1, 0, rest)}, 1);
  }
  return x;
}

/// All tokens at once; h0 defined.
ScanResult scan_chunk(const ScanArguments& s) {
  const torch::Tensor decay = torch::exp(s.delta.unsqueeze(3) * s.A);
  torch::Tensor x = (s.delta * s.u).unsqueeze(3) * s.B.unsqueeze(2);
  const torch::Tensor first = x.narrow(1, 0, 1) + decay.narrow(1, 0, 1) * s.h0.unsqueeze(1);
  x = torch::cat({first, x.narrow(1, 1, x.size(1) - 1)}, 1);
  const torch::Tensor h = scan_recurrence(decay, x);
  torch::Tensor y = torch::matmul(h, s.C.unsqueeze(3)).squeeze(3) + s.D * s.u;
  if (s.z.defined()) y = y * torch::silu(s.z);
  return {y, h.select(1, h.size(1) - 1)};
}

ScanArguments tokens_of(const ScanArguments& s, const torch::Tensor& h0, std::int64_t begin,
                        std::int64_t count) {
  const auto cut = [&](const torch::Tensor& t) { return t.defined() ? t.narrow(1, begin, count) : t; };
  return {cut(s.u), cut(s.delta), s.A, cut(s.B), cut(s.C), s.D, cut(s.z), h0};
}

/// What is differentiated, in the order of ScanFunction's arguments; an undefined gate is left out.
std::vector<torch::Tensor*> tensors_of(ScanArguments& s) {
  std::vector<torch::Tensor*> list{&s.u, &s.delta, &s.A, &s.B, &s.C, &s.D, &s.h0};
  if (s.z.defined()) list.push_back(&s.z);
  return list;
}

class ScanFunction : public torch::autograd::Function<ScanFunction> {
 public:
  static torch::autograd::variable_list forward(
      torch::autograd::AutogradContext* context, const torch::Tensor& u, const torch::Tensor& delta,
      const torch::Tensor& A, const torch::Tensor& B, const torch::Tensor& C, const torch::Tensor& D,
      const torch::Tensor& h0, const c10::optional<torch::Tensor>& gate, std::int64_t chunk) {
    const ScanArguments all{u, delta, A, B, C, D, gate.value_or(torch::Tensor()), h0};
    const std::int64_t length = u.size(1);
    std::vector<torch::Tensor> y, starts;
    torch::Tensor h = h0;
    for (std::int64_t begin = 0; begin < length; begin += chunk) {
      starts.push_back(h);
      const ScanResult part = scan_chunk(tokens_of(all, h, begin, std::min(chunk, length - begin)));
      y.push_back(part.y);
      h = part.last_state;
    }
    context->save_for_backward({u, delta, A, B, C, D, h0, all.z, torch::stack(starts)});
    context->saved_data["chunk"] = chunk;
    return {torch::cat(y, 1), h.clone()};
  }

  static torch::autograd::variable_list backward(torch::autograd::AutogradContext* context,
                                                 const torch::autograd::variable_list& gradients) {
    refuse_second_derivative(kName);
    const auto saved = context->get_saved_variables();
    const ScanArguments all{saved[0], saved[1], saved[2], saved[3], saved[4], saved[5], saved[7], saved[6]};
    const std::int64_t chunk = context->saved_data["chunk"].toInt(), length = all.u.size(1);
    const torch::Tensor dy = gradients[0].defined() ? gradients[0] : torch::zeros_like(all.u);
    torch::Tensor dh = gradients[1].defined() ? gradients[1] : torch::zeros_like(all.h0);
    ScanArguments total{torch::empty_like(all.u), torch::empty_like(all.delta), torch::zeros_like(all.A),
                        torch::empty_like(all.B), torch::empty_like(all.C),     torch::zeros_like(all.D)};
    if (all.z.defined()) total.z = torch::empty_like(all.z);
    for (std::int64_t at = saved[8].size(0) - 1; at >= 0; --at) {
      const std::int64_t begin = at * chunk, count = std::min(chunk, length - begin);
      const torch::AutoGradMode differentiate(true);
      ScanArguments part = tokens_of(all, saved[8][at], begin, count);
      std::vector<torch::Tensor> leaves;
      for (torch::Tensor* t : tensors_of(part)) leaves.push_back(*t = t->detach().requires_grad_());
      const ScanResult again = scan_chunk(part);
      const auto d =
          torch::autograd::grad({again.y, again.last_state}, leaves, {dy.narrow(1, begin, count), dh});
      const torch::NoGradGuard no_grad;
      ScanArguments place = tokens_of(total, {}, begin, count);
      place.u.copy_(d[0]), place.delta.copy_(d[1]), place.B.copy_(d[3]), place.C.copy_(d[4]);
      if (place.z.defined()) place.z.copy_(d[7]);
      total.A.add_(d[2]), total.D.add_(d[5]);
      dh = d[6];
    }
    return {total.u, total.delta, total.A, total.B, total.C, total.D, dh, total.z, {}};
  }
};

}  // namespace

ScanResult scan_by_tensors(const ScanArguments& a, std::int64_t chunk) {
  if (!a.u.defined() || a.u.dim() != 3 || a.u.size(1) == 0)
    throw std::invalid_argument("scan_by_tensors: u must be [batch, length, channels] with a token");
  const std::int64_t batch = a.u.size(0), channels = a.u.size(2), states = a.A.size(1);
  const torch::Tensor h0 = a.h0.defined() ? a.h0 : torch::zeros({batch, channels, states}, a.u.options());
  if (chunk <= 0) {
    constexpr std::int64_t most_states = std::int64_t{1} << 24, shortest = 16;
    chunk = std::max(shortest, most_states / std::max<std::int64_t>(1, batch * channels * states));
  }
  const c10::optional<torch::Tensor> gate = a.z.defined() ? c10::make_optional(a.z) : c10::nullopt;
  const auto out = ScanFunction::apply(a.u, a.delta, a.A, a.B, a.C, a.D, h0, gate, chunk);
  return {out[0], out[1]};
}

torch::Tensor causal_conv_silu_by_tensors(const torch::Tensor& x, const torch::Tensor& weight,
                                          const torch::Tensor& bias, const torch::Tensor& tail) {
  if (!x.defined() || x.dim() != 3 || !weight.defined() || weight.dim() != 2)
    throw std::invalid_argument("causal_conv_silu: x must have three dimensions and weight two");
  const std::int64_t taps = weight.size(0), length = x.size(1);
  const torch::Tensor before =
      tail.defined() ? tail : torch::zeros({x.size(0), taps - 1, x.size(2)}, x.options());
  const torch::Tensor extended = torch::cat({before, x}, 1);
  torch::Tensor y = bias;
  for (std::int64_t k = 0; k < taps; ++k) y = y + weight[k] * extended.narrow(1, k, length);
  return torch::silu(y);
}

}  // namespace flowscope
