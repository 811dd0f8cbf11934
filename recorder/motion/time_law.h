// When a path is where: as fast as every joint's limits allow.
#pragma once

#include <vector>

#include "recorder/motion/rounded_path.h"

namespace flowscope {

struct MotionLimits;

/// From rest to rest along a path. At every place each joint keeps its velocity, and what its acceleration
/// along the path and around the path's bends add up to keeps the limit; braking along the path is gentler.
class TimeLaw {
 public:
  TimeLaw(const RoundedPath& path, const MotionLimits& limits);
  double duration_s() const { return times_.empty() ? 0 : times_.back(); }
  /// Arc length, rad, at a time within the duration.
  double at(double time_s) const;

 private:
  std::vector<double> places_, speeds_, times_;  ///< at the ends of the path's intervals: rad, rad/s, s
};

}  // namespace flowscope
