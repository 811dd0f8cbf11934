#include "policy/point_kernel_body.h"

namespace flowscope {

const PointKernels kPortablePointKernels{"portable", lower<4>, farthest<4>};

}  // namespace flowscope
