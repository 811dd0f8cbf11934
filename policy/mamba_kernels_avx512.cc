#include "policy/mamba_kernel_table.h"

namespace flowscope {

const MambaKernels kAvx512Kernels = mamba_kernels_of_width<16>("AVX-512");

}  // namespace flowscope
