// One encoded picture, shared by every viewer.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace flowscope::web {

struct EncodedFrame {
  std::vector<std::uint8_t> jpeg;
  std::uint64_t sequence = 0;
  double timestamp_s = 0;  ///< wall clock (Unix) when the state was taken
};
using FramePtr = std::shared_ptr<const EncodedFrame>;

}  // namespace flowscope::web
