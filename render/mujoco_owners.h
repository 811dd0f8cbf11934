// Owners for MuJoCo's model and data, without MuJoCo's header: other folders use them too.
#pragma once

#include <memory>

struct mjModel_;
struct mjData_;

namespace flowscope {

struct ModelDeleter {
  void operator()(mjModel_* model) const;
};
struct DataDeleter {
  void operator()(mjData_* data) const;
};
using ModelPtr = std::unique_ptr<mjModel_, ModelDeleter>;
using DataPtr = std::unique_ptr<mjData_, DataDeleter>;

}  // namespace flowscope
