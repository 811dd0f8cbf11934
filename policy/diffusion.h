// Denoising diffusion, the ablation's other objectives: DDIM and DDPM share all but the noise of a step.
#pragma once

#include "policy/noise_schedule.h"
#include "policy/objective.h"

namespace flowscope {

/// Path x_s = √ᾱ_s x1 + √(1 - ᾱ_s) ε over 100 squared-cosine steps; the target is the noise ε (Ho et al.
/// 2020, arXiv 2006.11239). An end point that is derived from ε is held in [-1, 1], where every pose of the
/// workspace lies: at pure noise it is a difference divided by nearly nothing.
class Diffusion : public Objective {
 public:
  enum class Sampler {
    ddim,  ///< deterministic (Song et al. 2020, arXiv 2010.02502, eq. 12 with σ = 0)
    ddpm   ///< ancestral: σ² is the posterior's variance (arXiv 2006.11239, eq. 7), also over skipped steps
  };
  explicit Diffusion(Sampler sampler) : sampler_(sampler) {}
  std::string name() const override { return sampler_ == Sampler::ddim ? "ddim" : "ddpm"; }
  /// The time of one of the 100 steps that add noise, each as often.
  double draw_time(Random& random) const override;
  Vector9 noisy(const Vector9& x0, const Vector9& x1, double t) const override;
  Vector9 target(const Vector9& x0, const Vector9& /*x1*/) const override { return x0; }
  /// ᾱ / (1 - ᾱ), which turns an end point's error into ε's, held in [1, 16]: few-step sampling rests on the
  /// end point seen at pure noise, where ε's error says nothing of it.
  double end_point_weight(double t) const override;
  double grid(double from, int k, int n) const override;
  bool is_flow() const override { return false; }
  /// (x' - x) / (t_next - t), where x' is the sampler's next state.
  Vector9 velocity(const Answer& answer, const FlowState& at, const FlowState& start, double t_next,
                   Random& noise) const override;

 private:
  const Sampler sampler_;
  const NoiseSchedule schedule_;
};

}  // namespace flowscope
