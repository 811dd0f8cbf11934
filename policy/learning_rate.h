// How fast the weights move, from the first step to the expected end.
#pragma once

#include "policy/preset.h"
#include "policy/trainer.h"

namespace flowscope {

/// Learning rate of the step after `now`: rises evenly over the warm-up steps, then stays level; where the
/// options say when the run ends (minutes before steps), a half cosine leads down to 2 % of it.
double learning_rate_at(const TrainRates& rates, const TrainOptions& options, const TrainStatus& now);

}  // namespace flowscope
