// Conditional flow matching (paper §3.4; Lipman et al. 2023, arXiv 2210.02747): straight paths.
#pragma once

#include "policy/objective.h"

namespace flowscope {

/// Path x_t = t x1 + (1 - t) x0, target u = x1 - x0 = (x1 - x_t) / (1 - t).
class FlowMatching : public Objective {
 public:
  /// See make_objective.
  explicit FlowMatching(const std::string& times);
  std::string name() const override { return "cfm"; }
  double draw_time(Random& random) const override;
  Vector9 noisy(const Vector9& x0, const Vector9& x1, double t) const override;
  Vector9 target(const Vector9& x0, const Vector9& x1) const override;
  /// (1 / (1 - t))², held at 16: otherwise the last steps, where x_t tells the answer, drown all others.
  double end_point_weight(double t) const override;
  double grid(double from, int k, int n) const override;
  bool is_flow() const override { return true; }
  /// Grounded: (x̂1 - x) / (1 - t). At t = 1, where that is 0 / 0, a stage takes the mean velocity of its step
  /// to the end point that it sees, (x̂1 - x_start) / (1 - t_start): finite, and the limit for a constant x̂1.
  Vector9 velocity(const Answer& answer, const FlowState& at, const FlowState& start, double t_next,
                   Random& noise) const override;

 private:
  enum class Times { logit_normal, uniform, beta };
  Times times_ = Times::logit_normal;
  double deviation_ = 1.5;  // few-step grids evaluate at t = 0, which the standard logit-normal hardly draws
};

}  // namespace flowscope
