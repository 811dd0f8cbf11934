#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "policy/flow_trace.h"

namespace flowscope {

double RadiusSchedule::radius_m(double t) const {
  const double s = std::clamp(t, 0.0, 1.0);
  if (kind == "linear") return (1 - s) * (r_0 - r_min) + r_min;
  if (kind == "cosine") return r_min + 0.5 * (r_0 - r_min) * (1 + std::cos(std::numbers::pi * s));
  if (kind == "off") return r_0;
  throw std::invalid_argument("radius schedule '" + kind + "' is none of linear, cosine, off");
}

}  // namespace flowscope
