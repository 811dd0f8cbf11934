// How much faster than real time demonstrations are recorded.
#pragma once

#include <filesystem>
#include <vector>

#include "policy/bench.h"

namespace flowscope {

/// Records `episodes` placements of each of the ten tasks of the paper's Table 1 the way `flowscope record`
/// does: physics, planning, 128x128 colour and depth from four cameras at every keyframe, the file on disk.
/// Values are seconds simulated per second of the clock, one row for each task and one for all together, and
/// what share of the clock the pictures took. `scratch` is where the files go.
std::vector<BenchResult> bench_record(const std::filesystem::path& assets,
                                      const std::filesystem::path& scratch, int episodes = 6);

}  // namespace flowscope
