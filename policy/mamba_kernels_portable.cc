#include "policy/conv_kernel_body.h"
#include "policy/mamba_kernels.h"
#include "policy/scan_kernel_body.h"

namespace flowscope {

const MambaKernels kPortableKernels{"portable",      4, scan_forward<4>, scan_backward<4>, conv_forward<4>,
                                    conv_backward<4>};

}  // namespace flowscope
