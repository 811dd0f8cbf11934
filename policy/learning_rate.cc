#include "policy/learning_rate.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flowscope {

double learning_rate_at(const TrainRates& rates, const TrainOptions& options, const TrainStatus& now) {
  const auto step = static_cast<double>(now.step);
  const double warm = std::min(1.0, (step + 1) / std::max(1, rates.warmup_steps));
  double done = 0;
  if (options.expected_minutes > 0)
    done = now.minutes / options.expected_minutes;
  else if (options.expected_steps > 0)
    done = step / static_cast<double>(options.expected_steps);
  const double fall = 0.02 + 0.98 * 0.5 * (1 + std::cos(std::numbers::pi * std::clamp(done, 0.0, 1.0)));
  return rates.learning_rate * warm * fall;
}

}  // namespace flowscope
