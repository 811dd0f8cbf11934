#include "recorder/motion/time_law.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "recorder/motion/trajectory.h"

namespace flowscope {
namespace {

using Interval = RoundedPath::Interval;
constexpr double kEndless = std::numeric_limits<double>::infinity();

/// Largest square of the speed anywhere in the interval.
double cap(const Interval& interval, const MotionLimits& limits) {
  double result = kEndless;
  for (int i = 0; i < RoundedPath::joints; ++i) {
    const double speed = limits.velocity / interval.slope[i];
    result = std::min({result, speed * speed, limits.acceleration / interval.bend[i]});
  }
  return result;
}

/// Largest square of the speed at the faster end, given that at the slower one: along the path it changes by
/// at most `along`, and with what the bend takes at the faster end by at most the acceleration.
double faster_end(const Interval& interval, double slower, double along, const MotionLimits& limits) {
  double result = kEndless;
  for (int i = 0; i < RoundedPath::joints; ++i) {
    const double per_square = interval.slope[i] / (2 * interval.length);
    if (per_square <= 0) continue;
    result = std::min(result, slower + along / per_square);
    result = std::min(result, (limits.acceleration + per_square * slower) / (interval.bend[i] + per_square));
  }
  return result;
}

}  // namespace

TimeLaw::TimeLaw(const RoundedPath& path, const MotionLimits& limits) {
  const std::vector<Interval> intervals = path.intervals();
  const std::size_t n = intervals.size();
  if (n == 0) return;
  std::vector<double> square(n + 1, kEndless);
  square.front() = square.back() = 0;
  for (std::size_t k = 0; k < n; ++k) {
    const double most = intervals[k].stop_before && k > 0 ? 0 : kEndless;
    square[k] = std::min({square[k], most, cap(intervals[k], limits)});
    square[k + 1] = std::min(square[k + 1], cap(intervals[k], limits));
  }
  for (std::size_t k = 0; k < n; ++k) {
    square[k + 1] = std::min(square[k + 1], faster_end(intervals[k], square[k], limits.acceleration, limits));
  }
  for (std::size_t k = n; k-- > 0;) {
    square[k] = std::min(square[k], faster_end(intervals[k], square[k + 1], limits.deceleration, limits));
  }
  for (std::size_t k = 0; k <= n; ++k) {
    speeds_.push_back(std::sqrt(square[k]));
    places_.push_back(k < n ? intervals[k].begin : path.length());
    times_.push_back(k == 0 ? 0
                            : times_[k - 1] + 2 * intervals[k - 1].length / (speeds_[k - 1] + speeds_[k]));
  }
}

double TimeLaw::at(double time_s) const {
  const auto after = std::ranges::upper_bound(times_, time_s);
  if (after == times_.begin()) return places_.front();
  if (after == times_.end()) return places_.back();
  const auto k = static_cast<std::size_t>(after - times_.begin()) - 1;
  const double whole = times_[k + 1] - times_[k], t = time_s - times_[k];
  return places_[k] + speeds_[k] * t + 0.5 * (speeds_[k + 1] - speeds_[k]) / whole * t * t;
}

}  // namespace flowscope
