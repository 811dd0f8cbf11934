// How fast a policy answers: the fast path against the same network by other means, all in one run.
#pragma once

#include <string>
#include <vector>

#include "policy/bench.h"

namespace flowscope {

struct InferBenchOptions {
  std::string preset = "paper";
  int flow_steps = 4;
  int repeats = 5;         ///< the fastest of them counts
  bool plain_scan = true;  ///< also by the token-by-token scan: once, and minutes at the paper's size
};

/// Random weights and a synthetic scene, on the calling thread's torch settings. Results named predict_… are
/// whole predictions; all others are of the network alone, without the choice of points. A prediction here is
/// the encoders and `flow_steps` evaluations. The comparisons run the whole sequence at every step, their
/// encoders not counted. The matrix products are those of the prediction (as LibTorch runs them), each size
/// again and again in memory that stays in the cache.
std::vector<BenchResult> bench_infer(const InferBenchOptions& options = {});

}  // namespace flowscope
