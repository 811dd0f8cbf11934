// From noise to action, keeping every step (paper §3.4: x ← x + v(x, t) Δt).
#pragma once

#include <optional>

#include "policy/model.h"
#include "policy/policy.h"
#include "policy/sample.h"

namespace flowscope {

/// A scene as the network keeps it along the flow.
struct EncodedScene {
  Model& model;
  const SceneInput& input;
  SceneMemory memory;
};

/// One trace on its way from noise to action. The state is integrated in double, so x[k+1] = x[k] +
/// velocity[k] (t[k+1] - t[k]) holds exactly for the stored numbers.
class FlowRun {
 public:
  FlowRun(const Model& model, const PredictOptions& options, std::uint64_t seed);
  /// The next entry of the trace; false when it was the last.
  bool step(const EncodedScene& scene);
  std::size_t left() const { return times_.size() - trace_.steps.size(); }
  FlowTrace& trace() { return trace_; }

 private:
  PredictOptions options_;
  FlowTrace trace_;
  std::vector<double> times_;
  Vector9 x_{};
};

/// One trace per seed (seed, seed + 1, …; `count` of them), the scene encoded once, with the first step. The
/// traces begin as copies of `origin`: instruction, policy, scene and dates are the caller's. Constructor:
/// throws std::invalid_argument for options that do not fit the model's objective or each other.
class FlowPrediction : public Prediction {
 public:
  FlowPrediction(Model& model, SceneInput input, const PredictOptions& options, int count,
                 const FlowTrace& origin = {});
  bool advance(std::chrono::milliseconds slice) override;
  std::size_t left() const override;
  std::vector<FlowTrace> take() override;

 private:
  Model& model_;
  const SceneInput input_;
  std::optional<EncodedScene> scene_;
  std::vector<FlowRun> runs_;
  std::size_t current_ = 0;  ///< one after the other: in one batch matrix products would round otherwise
};

/// The same, to the end.
std::vector<FlowTrace> integrate_samples(Model& model, const SceneInput& input, const PredictOptions& options,
                                         int count);
FlowTrace integrate_flow(Model& model, const SceneInput& input, const PredictOptions& options);

}  // namespace flowscope
