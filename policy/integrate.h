// From noise to action, keeping every step (paper §3.4: x ← x + v(x, t) Δt).
#pragma once

#include "policy/model.h"

namespace flowscope {

/// Steps, result, radius, seed and flow_steps of the trace; the rest is the caller's. The state is integrated
/// in double, so x[k+1] = x[k] + velocity[k] (t[k+1] - t[k]) holds exactly for the stored numbers.
FlowTrace integrate_flow(Model& model, const SceneInput& input, const PredictOptions& options);

}  // namespace flowscope
