#include "policy/adamw.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace flowscope {
namespace {

double squared_norm(const torch::Tensor& gradient) {
  if (!gradient.is_cpu()) return gradient.square().sum().item<double>();
  const torch::Tensor flat = gradient.contiguous();
  const float* g = flat.data_ptr<float>();
  const std::int64_t n = flat.numel();
  float sum = 0;
#pragma omp simd reduction(+ : sum)
  for (std::int64_t i = 0; i < n; ++i) sum += g[i] * g[i];
  return sum;
}

}  // namespace

AdamW::AdamW(torch::nn::Module& module, const AdamWOptions& options) : options_(options) {
  for (const auto& item : module.named_parameters()) {
    const torch::Tensor& w = item.value();
    const bool decays = w.dim() > 1 && !item.key().ends_with("A_log");
    const torch::Tensor zero = torch::zeros_like(w, torch::MemoryFormat::Contiguous).detach();
    slots_.push_back({item.key(), w, zero, zero.clone(), w.detach().clone(), decays});
  }
}

AdamW::Step AdamW::next_step(double learning_rate, double norm) const {
  Step s;
  s.learning_rate = learning_rate;
  s.clip = static_cast<float>(norm > options_.clip ? options_.clip / norm : 1.0);
  s.beta1 = static_cast<float>(options_.beta1), s.beta2 = static_cast<float>(options_.beta2);
  s.rate = static_cast<float>(learning_rate / (1 - std::pow(options_.beta1, steps)));
  s.root = static_cast<float>(1 / std::sqrt(1 - std::pow(options_.beta2, steps)));
  s.epsilon = static_cast<float>(options_.epsilon);
  // Early steps average little, so that the mean is not stuck at the first random weights.
  s.keep = static_cast<float>(std::min(options_.ema, (1.0 + steps) / (10.0 + steps)));
  return s;
}

float AdamW::shrink(const Slot& slot, const Step& step) const {
  return static_cast<float>(slot.decays ? 1 - step.learning_rate * options_.weight_decay : 1.0);
}

void AdamW::update_fused(Slot& slot, const Step& s) const {
  const torch::Tensor flat = slot.weight.grad().contiguous();
  const float* g = flat.data_ptr<float>();
  float *w = slot.weight.data_ptr<float>(), *m = slot.m.data_ptr<float>(), *v = slot.v.data_ptr<float>(),
        *mean = slot.mean.data_ptr<float>();
  const float smaller = shrink(slot, s);
  const std::int64_t n = slot.weight.numel();
#pragma omp simd
  for (std::int64_t i = 0; i < n; ++i) {
    const float gi = g[i] * s.clip;
    m[i] = s.beta1 * m[i] + (1 - s.beta1) * gi;
    v[i] = s.beta2 * v[i] + (1 - s.beta2) * gi * gi;
    w[i] = smaller * w[i] - s.rate * m[i] / (std::sqrt(v[i]) * s.root + s.epsilon);
    mean[i] = s.keep * mean[i] + (1 - s.keep) * w[i];
  }
}

void AdamW::update_by_tensors(Slot& slot, const Step& s) const {
  const torch::NoGradGuard no_grad;
  const torch::Tensor g = slot.weight.grad() * s.clip;
  slot.m.mul_(s.beta1).add_(g, 1 - s.beta1);
  slot.v.mul_(s.beta2).addcmul_(g, g, 1 - s.beta2);
  slot.weight.mul_(shrink(slot, s)).addcdiv_(slot.m, slot.v.sqrt().mul_(s.root).add_(s.epsilon), -s.rate);
  slot.mean.mul_(s.keep).add_(slot.weight, 1 - s.keep);
}

double AdamW::step(double learning_rate) {
  double sum = 0;
  for (const Slot& slot : slots_)
    if (slot.weight.grad().defined()) sum += squared_norm(slot.weight.grad());
  const double norm = std::sqrt(sum);
  if (std::isfinite(norm)) {
    ++steps;
    const Step now = next_step(learning_rate, norm);
    for (Slot& slot : slots_) {
      if (!slot.weight.grad().defined()) continue;
      if (options_.fused && slot.weight.is_cpu())
        update_fused(slot, now);
      else
        update_by_tensors(slot, now);
    }
  }
  clear_gradients();
  return norm;
}

void AdamW::clear_gradients() {
  for (Slot& slot : slots_)
    if (slot.weight.grad().defined()) slot.weight.mutable_grad().reset();
}

std::vector<float> AdamW::gradients() const {
  std::vector<float> out;
  for (const Slot& slot : slots_) {
    const torch::Tensor grad = slot.weight.grad();
    const std::size_t at = out.size();
    out.resize(at + static_cast<std::size_t>(slot.weight.numel()));
    if (!grad.defined()) continue;
    const torch::Tensor flat = grad.cpu().contiguous();
    std::copy_n(flat.data_ptr<float>(), flat.numel(), out.begin() + static_cast<std::ptrdiff_t>(at));
  }
  return out;
}

void AdamW::set_gradients(const std::vector<float>& flat) {
  std::int64_t wanted = 0;
  for (const Slot& slot : slots_) wanted += slot.weight.numel();
  if (static_cast<std::int64_t>(flat.size()) != wanted)
    throw std::invalid_argument("gradients: " + std::to_string(wanted) + " numbers are needed, not " +
                                std::to_string(flat.size()));
  const torch::NoGradGuard no_grad;
  const torch::Tensor all = torch::from_blob(const_cast<float*>(flat.data()), {wanted}, torch::kFloat32);
  std::int64_t at = 0;
  for (Slot& slot : slots_) {
    const torch::Tensor part = all.narrow(0, at, slot.weight.numel());
    if (slot.weight.grad().defined()) slot.weight.mutable_grad().copy_(part.view(slot.weight.sizes()));
    at += slot.weight.numel();
  }
}

void AdamW::swap_mean() {
  const torch::NoGradGuard no_grad;
  for (Slot& slot : slots_) {
    const torch::Tensor weight = slot.weight.detach().clone();
    slot.weight.copy_(slot.mean);
    slot.mean.copy_(weight);
  }
}

std::map<std::string, torch::Tensor> AdamW::state() const {
  std::map<std::string, torch::Tensor> out;
  for (const Slot& slot : slots_) {
    out["m/" + slot.name] = slot.m;
    out["v/" + slot.name] = slot.v;
    out["mean/" + slot.name] = slot.mean;
  }
  return out;
}

}  // namespace flowscope
