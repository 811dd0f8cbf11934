// One Mamba block: norm, in-projection, causal convolution, selective scan, gate, out-projection, residual.
#pragma once

#include <torch/torch.h>

namespace flowscope {

struct MambaOptions {
  int d_model = 120, d_state = 16, d_conv = 4, expand = 2;
  int condition_dim =
      0;  ///< > 0: adaptive layer norm from a conditioning vector (zero-initialised scale and shift)
};

/// Paper §3.3: H1 = LN(F); H2 = SSM(SiLU(Conv1d(Linear(H1)))); out = Linear(H2 * SiLU(Linear(H1))); plus
/// residual. Causal, left to right. Initial values as in the published Mamba code (random ones from torch's
/// global generator).
class MambaBlockImpl : public torch::nn::Module {
 public:
  explicit MambaBlockImpl(const MambaOptions& options);
  /// x [batch, length, d_model], condition [batch, condition_dim] or undefined -> [batch, length, d_model].
  torch::Tensor forward(const torch::Tensor& x, const torch::Tensor& condition = {});
  /// A_log, D, the biases and the norm.
  std::vector<torch::Tensor> parameters_without_decay() const;
  const MambaOptions options;

 private:
  torch::nn::LayerNorm norm_{nullptr};
  torch::nn::Linear adaptive_{nullptr}, in_proj_{nullptr}, x_proj_{nullptr}, dt_proj_{nullptr},
      out_proj_{nullptr};
  torch::Tensor conv_weight_, conv_bias_, A_log_, D_;
};
TORCH_MODULE(MambaBlock);

}  // namespace flowscope
