#include "policy/integrator.h"

#include <stdexcept>
#include <vector>

namespace flowscope {
namespace {

/// Evaluated where the stage before it leads in a share `at` of the step.
struct Stage {
  double at, weight;
};

const std::vector<Stage>& stages_of(const std::string& integrator) {
  static const std::vector<Stage> euler{{0, 1}}, midpoint{{0, 0}, {0.5, 1}},
      rk4{{0, 1.0 / 6}, {0.5, 1.0 / 3}, {0.5, 1.0 / 3}, {1, 1.0 / 6}};
  if (integrator == "euler") return euler;
  if (integrator == "midpoint") return midpoint;
  if (integrator == "rk4") return rk4;
  throw std::invalid_argument("integrator '" + integrator +
                              "' is not available; there are: euler, midpoint, rk4");
}

}  // namespace

Vector9 step_velocity(const std::string& integrator, const VelocityField& field, const FlowState& start,
                      double t_next) {
  const double dt = t_next - start.t;
  Vector9 combined{}, velocity{};
  for (const Stage& stage : stages_of(integrator)) {
    // At exactly t_next, not next to it: the field may have a rule of its own at the end of time.
    FlowState at{start.x, stage.at == 1 ? t_next : start.t + stage.at * dt};
    for (std::size_t i = 0; i < at.x.size(); ++i) at.x[i] += velocity[i] * (stage.at * dt);
    velocity = field(at);
    for (std::size_t i = 0; i < combined.size(); ++i) combined[i] += stage.weight * velocity[i];
  }
  return combined;
}

}  // namespace flowscope
