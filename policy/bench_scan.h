// How fast the fused scan is, against its plain form and against the matrix products around it.
#pragma once

#include <vector>

#include "policy/bench.h"

namespace flowscope {

struct ScanBenchOptions {
  int batch = 32, length = 200, d_model = 128, d_state = 16;
  int repeats = 5;  ///< the fastest of them counts
};

/// Runs on the calling thread's torch settings; seconds at the default size.
std::vector<BenchResult> bench_scan(const ScanBenchOptions& options = {});

}  // namespace flowscope
