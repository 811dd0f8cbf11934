#include "policy/token_kernel_body.h"

namespace flowscope {

const TokenKernels kAvx512TokenKernels = token_kernels_of_width<16>("AVX-512");

}  // namespace flowscope
