// One Mamba block: norm, in-projection, causal convolution, selective scan, gate, out-projection, residual.
#pragma once

#include "policy/selective_scan.h"
#include "policy/torch_parts.h"

namespace flowscope {

struct MambaOptions {
  int d_model = 120, d_state = 16, d_conv = 4, expand = 2;
  int condition_dim =
      0;  ///< > 0: adaptive layer norm from a conditioning vector (zero-initialised scale and shift)
};

/// What a block must remember of the tokens behind it to run on: see MambaBlockImpl::forward_from.
struct MambaState {
  torch::Tensor conv_tail;  ///< [batch, d_conv - 1, channels], in-projected tokens before the convolution
  torch::Tensor h;          ///< [batch, channels, d_state]
};

/// The block's own parameters, by reference; channels E = expand * d_model, rank R = ceil(d_model / 16).
struct MambaWeights {
  torch::Tensor norm_weight, norm_bias;          ///< [d_model]
  torch::Tensor adaptive_weight, adaptive_bias;  ///< [2 d_model, condition_dim], [2 d_model]; or undefined
  torch::Tensor in_proj;                         ///< [2 E, d_model]
  torch::Tensor conv_weight, conv_bias;          ///< [d_conv, E], [E]
  torch::Tensor x_proj;                          ///< [R + 2 d_state, E]
  torch::Tensor dt_weight, dt_bias;              ///< [E, R], [E]
  torch::Tensor A_log, D;                        ///< [E, d_state], [E]
  torch::Tensor out_proj;                        ///< [d_model, E]
};

/// Throws std::invalid_argument unless x is [batch, length, d_model] and condition, where one is expected,
/// [batch, condition_dim].
void require_block_input(const MambaOptions& options, const torch::Tensor& x, const torch::Tensor& condition);

/// Paper §3.3: H1 = LN(F); H2 = SSM(SiLU(Conv1d(Linear(H1)))); out = Linear(H2 * SiLU(Linear(H1))); plus
/// residual. Causal, left to right. Initial values as in the published Mamba code (random ones from torch's
/// global generator).
class MambaBlockImpl : public torch::nn::Module {
 public:
  explicit MambaBlockImpl(const MambaOptions& options);
  /// x [batch, length, d_model], condition [batch, condition_dim] or undefined -> [batch, length, d_model].
  torch::Tensor forward(const torch::Tensor& x, const torch::Tensor& condition = {});
  /// The same for tokens that follow those that `state` remembers (empty: none), and `state` then remembers
  /// these too. A copied state can be run on from again and again. Differentiable through both states.
  torch::Tensor forward_from(MambaState& state, const torch::Tensor& x, const torch::Tensor& condition = {});
  /// A_log, D, the biases and the norm.
  std::vector<torch::Tensor> parameters_without_decay() const;
  MambaWeights weights() const;
  /// Scans by this instead of selective_scan; for comparisons.
  void scan_by(ScanResult (*scan)(const ScanArguments&)) { scan_ = scan; }
  const MambaOptions options;

 private:
  /// The convolution's and the scan's inputs, [batch, length, channels] each.
  struct Projected {
    torch::Tensor x, z;
  };
  Projected project_in(const torch::Tensor& x, const torch::Tensor& condition);
  ScanArguments scan_arguments(const torch::Tensor& u, const torch::Tensor& z, const torch::Tensor& h0);
  /// The last d_conv - 1 tokens of `tail` (undefined: zeros) and x together.
  torch::Tensor tail_after(const torch::Tensor& tail, const torch::Tensor& x) const;

  torch::nn::LayerNorm norm_{nullptr};
  torch::nn::Linear adaptive_{nullptr}, in_proj_{nullptr}, x_proj_{nullptr}, dt_proj_{nullptr},
      out_proj_{nullptr};
  torch::Tensor conv_weight_, conv_bias_, A_log_, D_;
  ScanResult (*scan_)(const ScanArguments&) = selective_scan;
};
TORCH_MODULE(MambaBlock);

}  // namespace flowscope
