// How much of the action is left at each of diffusion's steps.
#pragma once

#include <vector>

namespace flowscope {

/// Squared-cosine schedule (Nichol and Dhariwal 2021, arXiv 2102.09672, eq. 17) in `steps` discrete steps,
/// each of which adds at most a share of 0.999 noise. Step s = 0 is the action, s = steps is noise; flow time
/// is t = 1 - s / steps, so that t = 0 is noise and t = 1 the action as everywhere.
class NoiseSchedule {
 public:
  /// Throws std::invalid_argument for steps < 1.
  explicit NoiseSchedule(int steps = 100);
  int steps() const { return static_cast<int>(signal_.size()) - 1; }
  /// Cumulative alpha ᾱ: share of the action in the variance after s steps; 1 at s = 0, falling.
  double signal(int s) const { return signal_.at(static_cast<std::size_t>(s)); }
  /// The step nearest to flow time t in [0, 1], and back.
  int step_at(double t) const;
  double time_of(int s) const { return 1 - static_cast<double>(s) / steps(); }

 private:
  std::vector<double> signal_;
};

}  // namespace flowscope
