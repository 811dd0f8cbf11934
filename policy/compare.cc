#include <numbers>

#include "policy/flow_trace.h"

namespace flowscope {

void compare_with_expert(FlowTrace& trace, const GripperAction& expert) {
  const GripperAction& result = trace.result;
  trace.expert = expert;
  trace.error =
      PoseError{position_error_m(result.world_from_tool, expert.world_from_tool),
                rotation_error_rad(result.world_from_tool, expert.world_from_tool) * 180 / std::numbers::pi,
                result.open() == expert.open()};
}

}  // namespace flowscope
