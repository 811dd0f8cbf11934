#include "recorder/demo_stats.h"

#include <cmath>

namespace flowscope {

void TaskStats::add(const Demo& demo) {
  if (demo.frames.empty()) return;
  const Eigen::Vector3d& first = demo.frames.front().world_from_tool.position;
  if (demos == 0) {
    tool_extent = {first, first};
    bounds = demo.bounds;
  }
  ++demos;
  unfinished += demo.info.unfinished();
  ++by_variation[demo.info.variation];
  frames.add(static_cast<double>(demo.frames.size()));
  keyframes.add(static_cast<double>(demo.keyframes.size()));
  seconds.add(demo.frames.back().time_s - demo.frames.front().time_s);
  bytes += demo.info.bytes;
  int events = 0;
  for (std::size_t i = 0; i < demo.frames.size(); ++i) {
    const Frame& frame = demo.frames[i];
    const Eigen::Vector3d& tool = frame.world_from_tool.position;
    tool_extent = {tool_extent.min.cwiseMin(tool), tool_extent.max.cwiseMax(tool)};
    for (const double speed : frame.dq) max_joint_speed = std::max(max_joint_speed, std::abs(speed));
    if (i == 0) continue;
    const Frame& before = demo.frames[i - 1];
    events += frame.gripper_open != before.gripper_open;
    const double dt = frame.time_s - before.time_s;
    if (dt > 0) tool_speed_m_s.add((tool - before.world_from_tool.position).norm() / dt);
  }
  gripper_events.add(events);
  for (const Keyframe& keyframe : demo.keyframes) {
    keyframes_outside += !demo.bounds.contains(keyframe.action.world_from_tool.position);
  }
}

}  // namespace flowscope
