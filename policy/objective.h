// How noise becomes an action: noise path, target, time grid and integrator.
#pragma once

#include <memory>
#include <string>

#include "policy/flow_trace.h"
#include "policy/random.h"

namespace flowscope {

class Objective {
 public:
  virtual ~Objective() = default;
  virtual std::string name() const = 0;
  /// Training time in (0, 1), 0 noise, 1 action.
  virtual double draw_time(Random& random) const = 0;
  /// The state at `t` on the way from noise x0 to action x1.
  virtual Vector9 noisy(const Vector9& x0, const Vector9& x1, double t) const = 0;
  /// Velocity that leads from x at t to the end point.
  virtual Vector9 velocity_to(const Vector9& end_point, const Vector9& x, double t) const = 0;
  /// What the squared end point error weighs in the velocity loss at t.
  virtual double end_point_weight(double t) const = 0;
  /// t[k] of step k of n.
  virtual double grid(int k, int n) const = 0;
};

/// "cfm". Throws std::invalid_argument for another.
std::unique_ptr<Objective> make_objective(const std::string& name);

}  // namespace flowscope
