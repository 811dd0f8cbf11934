// From noise to action, keeping every step (paper §3.4: x ← x + v(x, t) Δt).
#pragma once

#include "policy/model.h"

namespace flowscope {

/// One trace per seed (seed, seed + 1, …; `count` of them), the scene encoded once: all of the trace but
/// instruction, policy, scene and dates, which are the caller's. The state is integrated in double, so
/// x[k+1] = x[k] + velocity[k] (t[k+1] - t[k]) holds exactly for the stored numbers. Throws
/// std::invalid_argument for options that do not fit the model's objective or each other.
std::vector<FlowTrace> integrate_samples(Model& model, const SceneInput& input, const PredictOptions& options,
                                         int count);
FlowTrace integrate_flow(Model& model, const SceneInput& input, const PredictOptions& options);

}  // namespace flowscope
