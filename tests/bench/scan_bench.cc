// Prints what bench_scan measures: scan_bench [batch length d_model d_state].
#include <cstdio>
#include <cstdlib>

#include "policy/bench_scan.h"

int main(int argc, char** argv) {
  flowscope::ScanBenchOptions options;
  if (argc == 5) {
    options.batch = std::atoi(argv[1]), options.length = std::atoi(argv[2]);
    options.d_model = std::atoi(argv[3]), options.d_state = std::atoi(argv[4]);
  }
  for (const auto& result : flowscope::bench_scan(options)) {
    std::printf("%-24s %9.3f %s", result.name.c_str(), result.value, result.unit.c_str());
    if (result.ratio) std::printf("   %.1f x %s", *result.ratio, result.against->c_str());
    std::printf("\n");
  }
}
