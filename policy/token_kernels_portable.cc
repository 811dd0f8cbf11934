#include "policy/token_kernel_body.h"

namespace flowscope {

const TokenKernels kPortableTokenKernels = token_kernels_of_width<4>("portable");

}  // namespace flowscope
