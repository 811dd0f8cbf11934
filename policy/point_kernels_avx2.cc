#include "policy/point_kernel_body.h"

namespace flowscope {

const PointKernels kAvx2PointKernels{"AVX2", lower<8>, farthest<8>};

}  // namespace flowscope
