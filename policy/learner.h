// One optimiser step: draw, augment, noise, predict, compare, descend.
#pragma once

#include <stop_token>

#include "policy/adamw.h"
#include "policy/exchange.h"
#include "policy/replicas.h"
#include "policy/training_set.h"

namespace flowscope {

/// Means over the batch. `position` and `rotation` are the two parts of `flow`, each per number, as weighted.
struct StepLoss {
  double total = 0, flow = 0, position = 0, rotation = 0, open = 0;
  bool skipped = false;  ///< loss or gradient was not finite; the weights are unchanged
  bool stopped = false;  ///< given up half-way; the weights are unchanged
};

struct LearnStep {
  double learning_rate = 0;
  Augmentation augment;
  /// Scene i of the whole batch has a random stream of its own from this: which process draws it, and how
  /// many there are, changes nothing.
  std::uint64_t seed = 0;
  torch::Device device = torch::kCPU;
  GradientExchange& exchange;
  std::stop_token stop = {};  ///< looked at several times in every part; of a single process only
};

/// As many as share the scenes of one step; always the same for the same number of scenes, because sums are
/// rounded in the order of the parts. One on a device other than the CPU.
Replicas make_replicas(const Model& model, const TrainRates& rates, const torch::Device& device);

/// Adds to the network's gradients those of this process' part of the batch, and averages them and the loss
/// over all processes.
/// Loss: 100 · mean (u - v)² over the 9-vector + 10 · cross-entropy of the openness. In the grounded form the
/// velocity error is the end point's error / (1 - t), with the factor held at 4; an L1 term on the end point
/// adds what squares lose near zero: millimetres.
StepLoss add_gradients(const Model& model, Replicas& replicas, AdamW& optimizer, const TrainingSet& data,
                       const TrainRates& rates, const LearnStep& how);

/// The same and one step of the optimiser, unless loss or gradient is not finite.
StepLoss learn_once(const Model& model, Replicas& replicas, AdamW& optimizer, const TrainingSet& data,
                    const TrainRates& rates, const LearnStep& how);

}  // namespace flowscope
