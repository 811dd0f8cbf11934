// How long something takes when nothing else gets in its way.
#pragma once

#include <algorithm>
#include <chrono>
#include <limits>

namespace flowscope {

/// Milliseconds of the fastest of `repeats` runs; one more goes before, for allocations and caches.
template <typename Work>
double fastest_run_ms(int repeats, Work&& work) {
  work();
  double best = std::numeric_limits<double>::infinity();
  for (int i = 0; i < repeats; ++i) {
    const auto start = std::chrono::steady_clock::now();
    work();
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
    best = std::min(best, took.count());
  }
  return best;
}

}  // namespace flowscope
