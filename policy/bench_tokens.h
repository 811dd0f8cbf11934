// How the time of a backbone grows with the number of tokens.
#pragma once

#include <string>
#include <vector>

#include "policy/bench.h"

namespace flowscope {

struct TokenBenchOptions {
  std::vector<int> tokens{1024, 2048, 4096, 8192, 16384};
  int channels = 120, d_state = 16, blocks = 2;
  int repeats = 5;  ///< the fastest of them counts
};

/// Without gradients, on the calling thread's torch settings; for every backbone the time at each length, and
/// how far the farthest lies from the line through them, as a share of the line (the line of least relative
/// squares).
std::vector<BenchResult> bench_tokens(const TokenBenchOptions& options = {});

}  // namespace flowscope
