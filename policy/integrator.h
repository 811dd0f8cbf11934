// How a flow's velocity field becomes one step: explicit Runge-Kutta methods.
#pragma once

#include <functional>
#include <string>

#include "policy/objective.h"

namespace flowscope {

/// Velocity at a state. Called once per stage, in the order of the stages; the first one is the step's start.
using VelocityField = std::function<Vector9(const FlowState&)>;

/// The stages' combined velocity: the state after the step is start.x + it (t_next - start.t). "euler" (order
/// 1, one stage), "midpoint" (2, two), "rk4" (4, four; its last stage lies at t_next). Throws
/// std::invalid_argument for another name. (Hairer, Nørsett and Wanner, Solving Ordinary Differential
/// Equations I, II.1.)
Vector9 step_velocity(const std::string& integrator, const VelocityField& field, const FlowState& start,
                      double t_next);

}  // namespace flowscope
