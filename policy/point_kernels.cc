#include "policy/point_kernels.h"

#include "policy/instruction_sets.h"

namespace flowscope {

const std::vector<const PointKernels*>& supported_point_kernels() {
  static const std::vector<const PointKernels*> supported =
      that_run_here(kAvx512PointKernels, kAvx2PointKernels, kPortablePointKernels);
  return supported;
}

}  // namespace flowscope
