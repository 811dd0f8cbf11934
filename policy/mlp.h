// Two layers with a GELU between them.
#pragma once

#include "policy/backbone.h"
#include "policy/torch_parts.h"

namespace flowscope {

/// x [..., in] -> [..., out]. Without gradients and float32 on the CPU a few rows at a time on the kernels,
/// within 1e-4 of torch's operators and bit-equal for any thread count. Its layers are named 0 and 2.
class MlpImpl : public torch::nn::Module {
 public:
  MlpImpl(int in, int channels, int out);
  torch::Tensor forward(const torch::Tensor& x);
  /// `fused` where never called.
  void run_by(ScanPath path) { path_ = path; }

 private:
  torch::Tensor run_fused(const torch::Tensor& x) const;

  torch::nn::Linear first_{nullptr}, second_{nullptr};
  ScanPath path_ = ScanPath::fused;
};
TORCH_MODULE(Mlp);

}  // namespace flowscope
