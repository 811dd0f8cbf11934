#include "policy/diffusion.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace flowscope {

double Diffusion::draw_time(Random& random) const {
  return schedule_.time_of(1 + random.below(schedule_.steps()));
}

Vector9 Diffusion::noisy(const Vector9& x0, const Vector9& x1, double t) const {
  const double signal = schedule_.signal(schedule_.step_at(t));
  Vector9 x;
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = std::sqrt(signal) * x1[i] + std::sqrt(1 - signal) * x0[i];
  return x;
}

double Diffusion::end_point_weight(double t) const {
  const double signal = schedule_.signal(schedule_.step_at(t));
  return std::clamp(signal / std::max(1 - signal, 1e-6), 1.0, 16.0);
}

double Diffusion::grid(double from, int k, int n) const {
  const int left = schedule_.step_at(from);
  if (n > left)
    throw std::invalid_argument(
        name() + " has " + std::to_string(left) + " of its " + std::to_string(schedule_.steps()) +
        " steps left at t = " + std::to_string(from) + "; it cannot take " + std::to_string(n));
  return schedule_.time_of(static_cast<int>(std::lround(static_cast<double>(left) * (n - k) / n)));
}

Vector9 Diffusion::velocity(const Answer& answer, const FlowState& at, const FlowState& /*start*/,
                            double t_next, Random& noise) const {
  const double here = schedule_.signal(schedule_.step_at(at.t)),
               there = schedule_.signal(schedule_.step_at(t_next));
  if (!(t_next > at.t) || here >= there)
    throw std::invalid_argument(name() + ": no step leads from t = " + std::to_string(at.t) +
                                " to t = " + std::to_string(t_next));
  const double variance =
      sampler_ == Sampler::ddim ? 0 : (1 - there) / (1 - here) * (1 - here / there);  // σ²
  const double to_noise = std::sqrt(std::max(1 - there - variance, 0.0));
  Vector9 v;
  for (std::size_t i = 0; i < v.size(); ++i) {
    double end_point = answer.value[i];
    if (!answer.end_point)
      end_point = std::clamp((at.x[i] - std::sqrt(1 - here) * end_point) / std::sqrt(here), -1.0, 1.0);
    const double epsilon = (at.x[i] - std::sqrt(here) * end_point) / std::sqrt(1 - here);
    const double next = std::sqrt(there) * end_point + to_noise * epsilon;
    const double fresh = variance > 0 ? std::sqrt(variance) * noise.normal() : 0;
    v[i] = (next + fresh - at.x[i]) / (t_next - at.t);
  }
  return v;
}

}  // namespace flowscope
