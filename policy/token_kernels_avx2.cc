#include "policy/token_kernel_body.h"

namespace flowscope {

const TokenKernels kAvx2TokenKernels = token_kernels_of_width<8>("AVX2");

}  // namespace flowscope
