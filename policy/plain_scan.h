// The selective scan as a loop of torch's own operators, token by token: what the fused one is compared with.
#pragma once

#include "policy/selective_scan.h"

namespace flowscope {

/// Same meaning as selective_scan, differentiated by torch itself; slow.
ScanResult plain_scan(const ScanArguments& arguments);

}  // namespace flowscope
