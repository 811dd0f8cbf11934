// AdamW (Loshchilov, Hutter 2019) with a running mean of the weights, one fused pass; its state is plain
// tensors.
#pragma once

#include <torch/torch.h>

#include <map>
#include <string>
#include <vector>

namespace flowscope {

struct AdamWOptions {
  double beta1 = 0.9, beta2 = 0.99, epsilon = 1e-8, weight_decay = 5e-4, clip = 1.0, ema = 0.998;
};

/// Biases, norms, A_log and D carry no weight decay: tensors of one dimension, and those named A_log.
class AdamW {
 public:
  AdamW(torch::nn::Module& module, const AdamWOptions& options);
  /// Gradients of the last backward pass, clipped to the norm `clip`; then clears them. Returns the norm
  /// before clipping; when it is not finite nothing has changed.
  double step(double learning_rate);
  /// Exchanges the weights and their running mean: the mean is what predicts.
  void swap_mean();
  /// Names m/…, v/…, mean/…; the tensors share storage with the optimiser.
  std::map<std::string, torch::Tensor> state() const;
  std::int64_t steps = 0;

 private:
  struct Slot {
    std::string name;
    torch::Tensor weight, m, v, mean;
    bool decays = true;
  };
  AdamWOptions options_;
  std::vector<Slot> slots_;
};

}  // namespace flowscope
