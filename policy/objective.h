// How noise becomes an action: noise path, training target and times, time grid, and where a step leads.
#pragma once

#include <memory>
#include <string>

#include "policy/flow_trace.h"
#include "policy/random.h"

namespace flowscope {

/// A state on the way: a normalised pose at flow time t, which is 0 at noise and 1 at the action for every
/// objective.
struct FlowState {
  Vector9 x{};
  double t = 0;
};

/// What the network says about a state.
struct Answer {
  Vector9 value{};
  bool end_point = true;  ///< the action x1 (grounded form); else the objective's own target (plain form)
};

/// Immutable, any thread.
class Objective {
 public:
  virtual ~Objective() = default;
  virtual std::string name() const = 0;
  /// Training time in [0, 1).
  virtual double draw_time(Random& random) const = 0;
  /// The state at `t` on the way from noise x0 to action x1.
  virtual Vector9 noisy(const Vector9& x0, const Vector9& x1, double t) const = 0;
  /// What the plain form learns to answer there.
  virtual Vector9 target(const Vector9& x0, const Vector9& x1) const = 0;
  /// What the squared end point error weighs in the grounded form's loss at t, from 1 to 16.
  virtual double end_point_weight(double t) const = 0;
  /// Time after k of n even steps from time `from` to 1. Throws std::invalid_argument when there are not so
  /// many steps.
  virtual double grid(double from, int k, int n) const = 0;
  /// Whether velocity() is a field, the same for every step length, so that any integrator may follow it.
  virtual bool is_flow() const = 0;
  /// The velocity at `at`, in a step that started at `start` (the same state in a one-stage step) and leads
  /// to time t_next: x + velocity (t_next - t) is where an Euler step ends. `noise` gives what an ancestral
  /// step adds.
  virtual Vector9 velocity(const Answer& answer, const FlowState& at, const FlowState& start, double t_next,
                           Random& noise) const = 0;
};

/// "cfm", "ddim", "ddpm". `times` are the training times of flow matching: "logit_normal" (standard deviation
/// 1.5), "logit_normal_unit" (1, the paper's), "uniform", "beta"; diffusion draws its steps evenly. Throws
/// std::invalid_argument for other names.
std::unique_ptr<Objective> make_objective(const std::string& name, const std::string& times = "logit_normal");

}  // namespace flowscope
