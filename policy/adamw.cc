#include "policy/adamw.h"

#include <algorithm>
#include <cmath>

namespace flowscope {

AdamW::AdamW(torch::nn::Module& module, const AdamWOptions& options) : options_(options) {
  for (const auto& item : module.named_parameters()) {
    const torch::Tensor& w = item.value();
    const bool decays = w.dim() > 1 && !item.key().ends_with("A_log");
    slots_.push_back({item.key(), w, torch::zeros_like(w), torch::zeros_like(w), w.detach().clone(), decays});
  }
}

double AdamW::step(double learning_rate) {
  double sum = 0;
  for (const Slot& s : slots_) {
    const torch::Tensor& g = s.weight.grad();
    if (!g.defined()) continue;
    const float* p = g.data_ptr<float>();
    float part = 0;
    for (std::int64_t i = 0; i < g.numel(); ++i) part += p[i] * p[i];
    sum += part;
  }
  const double norm = std::sqrt(sum);
  if (std::isfinite(norm)) {
    ++steps;
    const auto scale = static_cast<float>(norm > options_.clip ? options_.clip / norm : 1.0);
    const auto b1 = static_cast<float>(options_.beta1), b2 = static_cast<float>(options_.beta2);
    const double correct1 = 1 - std::pow(options_.beta1, steps),
                 correct2 = 1 - std::pow(options_.beta2, steps);
    const auto rate = static_cast<float>(learning_rate / correct1);
    const auto root = static_cast<float>(1 / std::sqrt(correct2)),
               epsilon = static_cast<float>(options_.epsilon);
    // Early steps average little, so that the mean is not stuck at the first random weights.
    const auto keep = static_cast<float>(std::min(options_.ema, (1.0 + steps) / (10.0 + steps)));
    for (Slot& s : slots_) {
      const torch::Tensor grad = s.weight.grad();
      if (!grad.defined()) continue;
      const torch::Tensor flat = grad.contiguous();
      const float* g = flat.data_ptr<float>();
      float *w = s.weight.data_ptr<float>(), *m = s.m.data_ptr<float>(), *v = s.v.data_ptr<float>(),
            *mean = s.mean.data_ptr<float>();
      const auto shrink = static_cast<float>(s.decays ? 1 - learning_rate * options_.weight_decay : 1.0);
      for (std::int64_t i = 0; i < s.weight.numel(); ++i) {
        const float gi = g[i] * scale;
        m[i] = b1 * m[i] + (1 - b1) * gi;
        v[i] = b2 * v[i] + (1 - b2) * gi * gi;
        w[i] = shrink * w[i] - rate * m[i] / (std::sqrt(v[i]) * root + epsilon);
        mean[i] = keep * mean[i] + (1 - keep) * w[i];
      }
    }
  }
  for (Slot& s : slots_)
    if (s.weight.grad().defined()) s.weight.mutable_grad().reset();
  return norm;
}

void AdamW::swap_mean() {
  const torch::NoGradGuard no_grad;
  for (Slot& s : slots_)
    std::swap_ranges(s.weight.data_ptr<float>(), s.weight.data_ptr<float>() + s.weight.numel(),
                     s.mean.data_ptr<float>());
}

std::map<std::string, torch::Tensor> AdamW::state() const {
  std::map<std::string, torch::Tensor> out;
  for (const Slot& s : slots_) {
    out["m/" + s.name] = s.m;
    out["v/" + s.name] = s.v;
    out["mean/" + s.name] = s.mean;
  }
  return out;
}

}  // namespace flowscope
