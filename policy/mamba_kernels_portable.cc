#include "policy/mamba_kernel_table.h"

namespace flowscope {

const MambaKernels kPortableKernels = mamba_kernels_of_width<4>("portable");

}  // namespace flowscope
