#include "policy/conv_kernel_body.h"
#include "policy/mamba_kernels.h"
#include "policy/scan_kernel_body.h"

namespace flowscope {

const MambaKernels kAvx512Kernels{"AVX-512",        16, scan_forward<16>, scan_backward<16>, conv_forward<16>,
                                  conv_backward<16>};

}  // namespace flowscope
