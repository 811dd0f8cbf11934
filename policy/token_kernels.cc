#include "policy/token_kernels.h"

#include "policy/instruction_sets.h"

namespace flowscope {

const std::vector<const TokenKernels*>& supported_token_kernels() {
  static const std::vector<const TokenKernels*> supported =
      that_run_here(kAvx512TokenKernels, kAvx2TokenKernels, kPortableTokenKernels);
  return supported;
}

}  // namespace flowscope
