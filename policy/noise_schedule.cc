#include "policy/noise_schedule.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace flowscope {

NoiseSchedule::NoiseSchedule(int steps) : signal_{1.0} {
  if (steps < 1) throw std::invalid_argument("a noise schedule needs at least one step");
  const auto curve = [steps](int s) {
    const double c = std::cos((static_cast<double>(s) / steps + 0.008) / 1.008 * std::numbers::pi / 2);
    return c * c;
  };
  for (int s = 1; s <= steps; ++s) {
    const double added = std::min(1 - curve(s) / curve(s - 1), 0.999);
    signal_.push_back(signal_.back() * (1 - added));
  }
}

int NoiseSchedule::step_at(double t) const {
  return std::clamp(static_cast<int>(std::lround((1 - t) * steps())), 0, steps());
}

}  // namespace flowscope
