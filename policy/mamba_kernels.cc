#include "policy/mamba_kernels.h"

namespace flowscope {
namespace {

std::vector<const MambaKernels*> find_supported() {
  std::vector<const MambaKernels*> found;
#if defined(__x86_64__)
  const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  if (avx2 && __builtin_cpu_supports("avx512f")) found.push_back(&kAvx512Kernels);
  if (avx2) found.push_back(&kAvx2Kernels);
#endif
  found.push_back(&kPortableKernels);
  return found;
}

}  // namespace

std::int64_t MambaKernels::scratch_floats(const ScanShape& shape) const {
  const std::int64_t per_step = shape.states * width;
  // The carried gradient of every block; then, for one chunk, states, decays and the lanes of dB and dC.
  return blocks(shape.channels) * per_step + (4 * kScanChunk + 1) * per_step;
}

const std::vector<const MambaKernels*>& supported_mamba_kernels() {
  static const std::vector<const MambaKernels*> supported = find_supported();
  return supported;
}

}  // namespace flowscope
