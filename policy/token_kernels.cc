#include "policy/token_kernels.h"

namespace flowscope {
namespace {

std::vector<const TokenKernels*> find_supported() {
  std::vector<const TokenKernels*> found;
#if defined(__x86_64__)
  const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  if (avx2 && __builtin_cpu_supports("avx512f")) found.push_back(&kAvx512TokenKernels);
  if (avx2) found.push_back(&kAvx2TokenKernels);
#endif
  found.push_back(&kPortableTokenKernels);
  return found;
}

}  // namespace

const std::vector<const TokenKernels*>& supported_token_kernels() {
  static const std::vector<const TokenKernels*> supported = find_supported();
  return supported;
}

}  // namespace flowscope
