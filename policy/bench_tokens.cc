#include "policy/bench_tokens.h"

#include <algorithm>
#include <cmath>

#include "policy/backbone.h"
#include "policy/bench_timer.h"
#include "policy/torch_parts.h"

namespace flowscope {
namespace {

/// Largest |y / line - 1| for the line a + b x of least squared relative error.
double off_line(const std::vector<int>& x, const std::vector<double>& y) {
  double s = 0, sx = 0, sxx = 0, sy = 0, sxy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double weight = 1 / (y[i] * y[i]);
    s += weight, sx += weight * x[i], sxx += weight * x[i] * x[i];
    sy += weight * y[i], sxy += weight * x[i] * y[i];
  }
  const double determinant = s * sxx - sx * sx;
  const double slope = (s * sxy - sx * sy) / determinant, start = (sxx * sy - sx * sxy) / determinant;
  double worst = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    worst = std::max(worst, std::abs(y[i] / (start + slope * x[i]) - 1));
  }
  return worst;
}

}  // namespace

std::vector<BenchResult> bench_tokens(const TokenBenchOptions& o) {
  const torch::NoGradGuard no_grad;
  torch::manual_seed(1);
  std::vector<BenchResult> results;
  for (const std::string kind : {"mamba", "transformer"}) {
    const Backbone stack =
        make_backbone(kind, {.channels = o.channels, .d_state = o.d_state, .blocks = o.blocks});
    std::vector<double> times;
    for (const int tokens : o.tokens) {
      const torch::Tensor x = torch::randn({1, tokens, o.channels});
      const int repeats = kind == "mamba" ? o.repeats : 1;  // the other takes long, and is not the question
      times.push_back(fastest_run_ms(repeats, [&] { stack->forward(x); }));
      results.push_back({kind + "_" + std::to_string(tokens) + "_tokens", times.back(), "ms", {}, {}});
    }
    if (o.tokens.size() < 3) continue;
    results.push_back({kind + "_off_line", 100 * off_line(o.tokens, times), "%", {}, {}});
  }
  return results;
}

}  // namespace flowscope
