// The Mamba form of the sequence model.
#pragma once

#include <vector>

#include "policy/backbone.h"
#include "policy/fused_stack.h"
#include "policy/mamba.h"

namespace flowscope {

/// Blocks one after the other. Where no gradient is recorded and everything is float32 on the CPU, the fused
/// path computes the same within 1e-4. std::invalid_argument for an input that does not fit.
class MambaStack : public BackboneImpl {
 public:
  explicit MambaStack(const BackboneOptions& options);
  torch::Tensor forward(const torch::Tensor& x, const torch::Tensor& condition) override;
  torch::Tensor forward_from(BackboneState& state, const torch::Tensor& x,
                             const torch::Tensor& condition) override;
  void run_by(ScanPath path) override;

 private:
  bool runs_fused(const torch::Tensor& x) const;

  std::vector<MambaBlock> blocks_;
  ScanPath path_ = ScanPath::fused;
  FusedStack fused_;
};

}  // namespace flowscope
