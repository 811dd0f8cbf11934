#include "policy/mamba_kernels.h"

#include "policy/instruction_sets.h"

namespace flowscope {

std::int64_t MambaKernels::scratch_floats(const ScanShape& shape) const {
  const std::int64_t per_step = shape.states * width;
  // The carried gradient of every block; then, for one chunk, states, decays and the lanes of dB and dC.
  return blocks(shape.channels) * per_step + (4 * kScanChunk + 1) * per_step;
}

const std::vector<const MambaKernels*>& supported_mamba_kernels() {
  static const std::vector<const MambaKernels*> supported =
      that_run_here(kAvx512Kernels, kAvx2Kernels, kPortableKernels);
  return supported;
}

}  // namespace flowscope
