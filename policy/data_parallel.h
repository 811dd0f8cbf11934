// What the processes of one training run tell each other.
#pragma once

#include "policy/adamw.h"
#include "policy/exchange.h"
#include "policy/learner.h"

namespace flowscope {

/// Weights, moments and running mean of rank 0 become everyone's: processors of two kinds may draw other
/// first weights from the same seed.
void share_weights(const Model& model, const AdamW& optimizer, GradientExchange& exchange);

/// Gradients and losses of all ranks become their mean, the same on every rank bit for bit. Where one rank
/// has a number that is not finite, all have.
void average_over_ranks(AdamW& optimizer, StepLoss& loss, GradientExchange& exchange);

}  // namespace flowscope
