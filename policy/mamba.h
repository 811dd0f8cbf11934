// One Mamba block: norm, in-projection, causal convolution, selective scan, gate, out-projection, residual.
#pragma once

#include <torch/torch.h>

#include "policy/selective_scan.h"

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

/// Paper §3.3: H1 = LN(F); H2 = SSM(SiLU(Conv1d(Linear(H1)))); out = Linear(H2 * SiLU(Linear(H1))); plus
/// residual. Causal, left to right. Initial values as in the published Mamba code (random ones from torch's
/// global generator).
class MambaBlockImpl : public torch::nn::Module {
 public:
  explicit MambaBlockImpl(const MambaOptions& options);
  /// x [batch, length, d_model], condition [batch, condition_dim] or undefined -> [batch, length, d_model].
  torch::Tensor forward(const torch::Tensor& x, const torch::Tensor& condition = {});
  /// The same for tokens that follow those that `state` remembers (empty: none), and `state` then remembers
  /// these too. A copied state can be run on from again and again. Not differentiable.
  torch::Tensor forward_from(MambaState& state, const torch::Tensor& x, const torch::Tensor& condition = {});
  /// A_log, D, the biases and the norm.
  std::vector<torch::Tensor> parameters_without_decay() const;
  const MambaOptions options;

 private:
  /// The convolution's and the scan's inputs, [batch, length, channels] each.
  struct Projected {
    torch::Tensor x, z;
  };
  Projected project_in(const torch::Tensor& x, const torch::Tensor& condition);
  /// Arguments of the scan but for h0, from the convolution's output.
  ScanArguments scan_arguments(const torch::Tensor& u, const torch::Tensor& z);

  torch::nn::LayerNorm norm_{nullptr};
  torch::nn::Linear adaptive_{nullptr}, in_proj_{nullptr}, x_proj_{nullptr}, dt_proj_{nullptr},
      out_proj_{nullptr};
  torch::Tensor conv_weight_, conv_bias_, A_log_, D_;
};
TORCH_MODULE(MambaBlock);

}  // namespace flowscope
