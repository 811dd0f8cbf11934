// One optimiser step: draw, augment, noise, predict, compare, descend.
#pragma once

#include "policy/adamw.h"
#include "policy/training_set.h"

namespace flowscope {

struct StepLoss {
  double total = 0, flow = 0, open = 0;
  bool skipped = false;  ///< loss or gradient was not finite; the weights are unchanged
};

/// Loss: 100 · mean (u - v)² over the 9-vector + 10 · cross-entropy of the openness. In the grounded form the
/// velocity error is the end point's error / (1 - t), with the factor held at 4; an L1 term on the end point
/// adds what squares lose near zero: millimetres.
StepLoss learn_once(Model& model, AdamW& optimizer, const TrainingSet& data, const TrainRates& rates,
                    bool augmented, double learning_rate, Random& random);

}  // namespace flowscope
