// How much of the render rate reaches viewers.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "policy/bench.h"

namespace flowscope {

/// Draws a turning camera at 640x480 without encoding or network, then streams the same through the whole
/// program to 1 and to 16 viewers on loopback. Ratios are streamed frames/s of the slowest viewer against
/// drawn-only frames/s, in this run.
std::vector<BenchResult> bench_stream(const std::filesystem::path& assets,
                                      const std::filesystem::path& scratch, double seconds_each = 4);

}  // namespace flowscope
