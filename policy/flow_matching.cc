#include "policy/flow_matching.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace flowscope {

FlowMatching::FlowMatching(const std::string& times) {
  if (times == "logit_normal_unit") {
    deviation_ = 1;
  } else if (times == "uniform") {
    times_ = Times::uniform;
  } else if (times == "beta") {
    times_ = Times::beta;
  } else if (times != "logit_normal") {
    throw std::invalid_argument("training times '" + times +
                                "' are not available; there are: logit_normal, logit_normal_unit, uniform, "
                                "beta");
  }
}

double FlowMatching::draw_time(Random& random) const {
  switch (times_) {
    case Times::uniform:
      return random.uniform();
    case Times::beta:
      // Beta(1.5, 1) of the noise's share 1 - t, by its inverse distribution function.
      return 1 - std::clamp(std::pow(random.uniform(), 1 / 1.5), 0.001, 0.999);
    case Times::logit_normal:
      break;
  }
  return 1.0 / (1.0 + std::exp(-deviation_ * random.normal()));
}

Vector9 FlowMatching::noisy(const Vector9& x0, const Vector9& x1, double t) const {
  Vector9 x;
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = t * x1[i] + (1 - t) * x0[i];
  return x;
}

Vector9 FlowMatching::target(const Vector9& x0, const Vector9& x1) const {
  Vector9 u;
  for (std::size_t i = 0; i < u.size(); ++i) u[i] = x1[i] - x0[i];
  return u;
}

double FlowMatching::end_point_weight(double t) const {
  const double rest = std::max(1 - t, 0.25);
  return 1 / (rest * rest);
}

double FlowMatching::grid(double from, int k, int n) const { return k == n ? 1 : from + (1 - from) * k / n; }

Vector9 FlowMatching::velocity(const Answer& answer, const FlowState& at, const FlowState& start,
                               double /*t_next*/, Random& /*noise*/) const {
  if (!answer.end_point) return answer.value;
  const FlowState& from = at.t < 1 ? at : start;
  Vector9 v;
  for (std::size_t i = 0; i < v.size(); ++i) v[i] = (answer.value[i] - from.x[i]) / (1 - from.t);
  return v;
}

}  // namespace flowscope
