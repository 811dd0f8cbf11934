// How fast a policy learns, and what a step of learning costs beyond its matrix products.
#pragma once

#include <string>
#include <vector>

#include "policy/bench.h"
#include "recorder/demo.h"

namespace flowscope {

struct LearnBenchOptions {
  std::string preset = "desk";
  int steps = 12;       ///< the fastest of them counts
  int plain_steps = 2;  ///< by torch's own operators, scan token by token; 0 leaves that out
};

/// Trains the preset on `demos` with torch's threads: samples per second, one step against its matrix
/// products alone and against the plain scan, all in this run, and memory per sample. Seconds at desk size.
std::vector<BenchResult> bench_learning(const std::vector<Demo>& demos,
                                        const LearnBenchOptions& options = {});

}  // namespace flowscope
