#include "policy/objective.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace flowscope {
namespace {

/// Conditional flow matching, paper §3.4: x_t = t x1 + (1 - t) x0, u = x1 - x0 = (x1 - x_t) / (1 - t),
/// logit-normal t.
class FlowMatching : public Objective {
 public:
  std::string name() const override { return "cfm"; }
  double draw_time(Random& random) const override {
    // Wider than the standard logit-normal: few-step grids evaluate at t = 0, which it hardly ever draws.
    return 1.0 / (1.0 + std::exp(-1.5 * random.normal()));
  }
  Vector9 noisy(const Vector9& x0, const Vector9& x1, double t) const override {
    Vector9 x;
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = t * x1[i] + (1 - t) * x0[i];
    return x;
  }
  Vector9 velocity_to(const Vector9& end_point, const Vector9& x, double t) const override {
    Vector9 v;
    for (std::size_t i = 0; i < v.size(); ++i) v[i] = (end_point[i] - x[i]) / std::max(1 - t, 1e-3);
    return v;
  }
  double end_point_weight(double t) const override {
    // (1 / (1 - t))², held at 16: otherwise the last steps, where x_t tells the answer, drown all others.
    const double rest = std::max(1 - t, 0.25);
    return 1 / (rest * rest);
  }
  double grid(int k, int n) const override { return static_cast<double>(k) / n; }
};

}  // namespace

std::unique_ptr<Objective> make_objective(const std::string& name) {
  if (name == "cfm") return std::make_unique<FlowMatching>();
  throw std::invalid_argument("objective '" + name + "' is not available; the one there is: cfm");
}

}  // namespace flowscope
