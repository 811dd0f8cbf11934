#include "policy/point_kernel_body.h"

namespace flowscope {

const PointKernels kAvx512PointKernels{"AVX-512", lower<16>, farthest<16>};

}  // namespace flowscope
