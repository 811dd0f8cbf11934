// Which of the three copies of a kernel this machine can run.
#pragma once

#include <vector>

namespace flowscope {

/// Fastest first; never empty.
template <typename Kernels>
std::vector<const Kernels*> that_run_here([[maybe_unused]] const Kernels& avx512,
                                          [[maybe_unused]] const Kernels& avx2, const Kernels& portable) {
  std::vector<const Kernels*> found;
#if defined(__x86_64__)
  const bool has_avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  if (has_avx2 && __builtin_cpu_supports("avx512f")) found.push_back(&avx512);
  if (has_avx2) found.push_back(&avx2);
#endif
  found.push_back(&portable);
  return found;
}

}  // namespace flowscope
