#include "policy/mamba_kernel_table.h"

namespace flowscope {

const MambaKernels kAvx2Kernels = mamba_kernels_of_width<8>("AVX2");

}  // namespace flowscope
