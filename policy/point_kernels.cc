#include "policy/point_kernels.h"

namespace flowscope {
namespace {

std::vector<const PointKernels*> find_supported() {
  std::vector<const PointKernels*> found;
#if defined(__x86_64__)
  const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  if (avx2 && __builtin_cpu_supports("avx512f")) found.push_back(&kAvx512PointKernels);
  if (avx2) found.push_back(&kAvx2PointKernels);
#endif
  found.push_back(&kPortablePointKernels);
  return found;
}

}  // namespace

const std::vector<const PointKernels*>& supported_point_kernels() {
  static const std::vector<const PointKernels*> supported = find_supported();
  return supported;
}

}  // namespace flowscope
