#include "policy/conv_kernel_body.h"
#include "policy/mamba_kernels.h"
#include "policy/scan_kernel_body.h"

namespace flowscope {

const MambaKernels kAvx2Kernels{"AVX2",          8, scan_forward<8>, scan_backward<8>, conv_forward<8>,
                                conv_backward<8>};

}  // namespace flowscope
