#include "policy/mamba.h"

#include <cmath>
#include <stdexcept>
#include <string>

#include "policy/causal_conv.h"
#include "policy/pointwise.h"
#include "policy/selective_scan.h"

namespace flowscope {
namespace {

constexpr double kSmallestInitialStep = 1e-3, kLargestInitialStep = 1e-1, kStepFloor = 1e-4;

/// Bias whose softplus is log-uniform between the two initial steps, [channels].
torch::Tensor initial_step_bias(std::int64_t channels) {
  const double low = std::log(kSmallestInitialStep), high = std::log(kLargestInitialStep);
  const torch::Tensor step = torch::exp(torch::rand({channels}) * (high - low) + low).clamp_min(kStepFloor);
  return step + torch::log(-torch::expm1(-step));
}

void check_options(const MambaOptions& options) {
  if (options.d_model < 1 || options.d_state < 1 || options.d_conv < 1 || options.expand < 1 ||
      options.condition_dim < 0) {
    throw std::invalid_argument("MambaOptions: d_model, d_state, d_conv and expand must be at least 1");
  }
}

}  // namespace

void require_block_input(const MambaOptions& options, const torch::Tensor& x,
                         const torch::Tensor& condition) {
  if (x.dim() != 3 || x.size(2) != options.d_model) {
    throw std::invalid_argument("MambaBlock: x must be [batch, length, " + std::to_string(options.d_model) +
                                "]");
  }
  if (condition.defined() != (options.condition_dim > 0)) {
    throw std::invalid_argument("MambaBlock: a condition is " +
                                std::string(condition.defined() ? "given but not expected" : "expected"));
  }
  if (condition.defined() && condition.sizes() != at::IntArrayRef({x.size(0), options.condition_dim})) {
    throw std::invalid_argument("MambaBlock: the condition must be [" + std::to_string(x.size(0)) + ", " +
                                std::to_string(options.condition_dim) + "]");
  }
}

MambaBlockImpl::MambaBlockImpl(const MambaOptions& block_options) : options(block_options) {
  check_options(options);
  const std::int64_t d_model = options.d_model, d_state = options.d_state;
  const std::int64_t channels = d_model * options.expand, dt_rank = (d_model + 15) / 16;
  using torch::nn::LinearOptions;
  norm_ = register_module("norm", torch::nn::LayerNorm(torch::nn::LayerNormOptions({d_model})));
  in_proj_ = register_module("in_proj", torch::nn::Linear(LinearOptions(d_model, 2 * channels).bias(false)));
  x_proj_ = register_module("x_proj",
                            torch::nn::Linear(LinearOptions(channels, dt_rank + 2 * d_state).bias(false)));
  dt_proj_ = register_module("dt_proj", torch::nn::Linear(dt_rank, channels));
  out_proj_ = register_module("out_proj", torch::nn::Linear(LinearOptions(channels, d_model).bias(false)));
  const double conv_bound = 1.0 / std::sqrt(static_cast<double>(options.d_conv));
  conv_weight_ = register_parameter(
      "conv_weight", torch::empty({options.d_conv, channels}).uniform_(-conv_bound, conv_bound));
  conv_bias_ = register_parameter("conv_bias", torch::empty({channels}).uniform_(-conv_bound, conv_bound));
  A_log_ = register_parameter(
      "A_log", torch::log(torch::arange(1, d_state + 1, torch::kFloat32)).repeat({channels, 1}));
  D_ = register_parameter("D", torch::ones({channels}));
  if (options.condition_dim > 0) {
    adaptive_ = register_module("adaptive", torch::nn::Linear(options.condition_dim, 2 * d_model));
  }
  const torch::NoGradGuard no_grad;
  const double dt_bound = 1.0 / std::sqrt(static_cast<double>(dt_rank));
  dt_proj_->weight.uniform_(-dt_bound, dt_bound);
  dt_proj_->bias.copy_(initial_step_bias(channels));
  if (adaptive_) {
    adaptive_->weight.zero_();
    adaptive_->bias.zero_();
  }
}

MambaBlockImpl::Projected MambaBlockImpl::project_in(const torch::Tensor& x, const torch::Tensor& condition) {
  require_block_input(options, x, condition);
  torch::Tensor normed = norm_->forward(x);
  if (condition.defined()) {
    const auto scale_shift = adaptive_->forward(torch::silu(condition)).unsqueeze(1).chunk(2, 2);
    normed = normed * (1 + scale_shift[0]) + scale_shift[1];
  }
  const auto halves = in_proj_->forward(normed).chunk(2, 2);
  return {halves[0], halves[1]};
}

ScanArguments MambaBlockImpl::scan_arguments(const torch::Tensor& u, const torch::Tensor& z,
                                             const torch::Tensor& h0) {
  const std::int64_t d_state = options.d_state, dt_rank = dt_proj_->options.in_features();
  const auto parts = x_proj_->forward(u).split_with_sizes({dt_rank, d_state, d_state}, 2);
  const torch::Tensor delta = softplus_of(dt_proj_->forward(parts[0]));
  return {u, delta, -torch::exp(A_log_), parts[1], parts[2], D_, z, h0};
}

torch::Tensor MambaBlockImpl::tail_after(const torch::Tensor& tail, const torch::Tensor& x) const {
  const std::int64_t remembered = options.d_conv - 1, length = x.size(1);
  // A copy, so that what is remembered does not keep the whole sequence alive.
  if (length >= remembered) return x.narrow(1, length - remembered, remembered).clone();
  const torch::Tensor before =
      tail.defined() ? tail : torch::zeros({x.size(0), remembered, x.size(2)}, x.options());
  return torch::cat({before.narrow(1, length, remembered - length), x}, 1);
}

torch::Tensor MambaBlockImpl::forward(const torch::Tensor& x, const torch::Tensor& condition) {
  MambaState nothing;
  return forward_from(nothing, x, condition);
}

torch::Tensor MambaBlockImpl::forward_from(MambaState& state, const torch::Tensor& x,
                                           const torch::Tensor& condition) {
  const Projected in = project_in(x, condition);
  const torch::Tensor u = causal_conv_silu(in.x, conv_weight_, conv_bias_, state.conv_tail);
  const ScanResult scanned = scan_(scan_arguments(u, in.z, state.h));
  state = {tail_after(state.conv_tail, in.x), scanned.last_state};
  return x + out_proj_->forward(scanned.y);
}

MambaWeights MambaBlockImpl::weights() const {
  MambaWeights w;
  w.norm_weight = norm_->weight, w.norm_bias = norm_->bias;
  if (adaptive_) w.adaptive_weight = adaptive_->weight, w.adaptive_bias = adaptive_->bias;
  w.in_proj = in_proj_->weight, w.conv_weight = conv_weight_, w.conv_bias = conv_bias_;
  w.x_proj = x_proj_->weight, w.dt_weight = dt_proj_->weight, w.dt_bias = dt_proj_->bias;
  w.A_log = A_log_, w.D = D_, w.out_proj = out_proj_->weight;
  return w;
}

std::vector<torch::Tensor> MambaBlockImpl::parameters_without_decay() const {
  std::vector<torch::Tensor> found;
  for (const auto& item : named_parameters()) {
    if (item.value().dim() == 1 || item.key() == "A_log") found.push_back(item.value());
  }
  return found;
}

}  // namespace flowscope
