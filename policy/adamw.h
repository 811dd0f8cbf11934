// AdamW (Loshchilov, Hutter 2019, arXiv 1711.05101) with a running mean of the weights; its state is plain
// tensors.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "policy/torch_parts.h"

namespace flowscope {

struct AdamWOptions {
  double beta1 = 0.9, beta2 = 0.99, epsilon = 1e-8, weight_decay = 5e-4, clip = 1.0, ema = 0.998;
  bool fused = true;  ///< one pass over each weight where it lies on the CPU; else tensor operations
};

/// Biases, norms, A_log and D carry no weight decay: tensors of one dimension, and those named A_log. The
/// module must already be on the device where it will learn.
class AdamW {
 public:
  AdamW(torch::nn::Module& module, const AdamWOptions& options);
  /// Gradients of the last backward pass, clipped to the norm `clip`; then clears them. Returns the norm
  /// before clipping; when it is not finite nothing has changed.
  double step(double learning_rate);
  void clear_gradients();
  /// All gradients one after the other, in the order of the module's parameters; zeros where there is none.
  std::vector<float> gradients() const;
  /// The other way; a weight without a gradient stays without. Throws std::invalid_argument for another
  /// count.
  void set_gradients(const std::vector<float>& flat);
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
  /// The numbers of one step that are the same for every weight.
  struct Step {
    float clip, beta1, beta2, rate, root, epsilon, keep;
    double learning_rate;
  };
  Step next_step(double learning_rate, double norm) const;
  float shrink(const Slot& slot, const Step& step) const;
  void update_fused(Slot& slot, const Step& step) const;
  void update_by_tensors(Slot& slot, const Step& step) const;

  AdamWOptions options_;
  std::vector<Slot> slots_;
};

}  // namespace flowscope
