#include "render/gripper_shape.h"

#include <mujoco/mujoco.h>

#include <algorithm>

namespace flowscope {

Pose tool_from_part(const GripperShape::Part& part, double openness) {
  const std::size_t intervals = part.tool_from_part.size() - 1;
  const double place = std::clamp(openness, 0.0, 1.0) * static_cast<double>(intervals);
  const std::size_t below = std::min(static_cast<std::size_t>(place), intervals - 1);
  const double t = place - static_cast<double>(below);
  const Pose &from = part.tool_from_part[below], &to = part.tool_from_part[below + 1];
  return {from.position + t * (to.position - from.position), from.rotation.slerp(t, to.rotation)};
}

GripperShape plain_gripper() {
  GripperShape shape;
  const auto add = [&](int type, const Eigen::Vector3d& half_size, const Eigen::Vector3d& closed,
                       const Eigen::Vector3d& open) {
    shape.parts.push_back({type, -1, half_size, {{closed, {1, 0, 0, 0}}, {open, {1, 0, 0, 0}}}});
  };
  constexpr double hand_top = -0.1034, hand_bottom = -0.045, tip = 0.009;
  const Eigen::Vector3d palm(0, 0, 0.5 * (hand_top + hand_bottom)), flange(0, 0, hand_top - 0.0125);
  add(mjGEOM_BOX, {0.0315, 0.102, 0.5 * (hand_bottom - hand_top)}, palm, palm);
  for (const double side : {-1.0, 1.0}) {
    const Eigen::Vector3d closed(0, side * 0.006, 0.5 * (hand_bottom + tip));
    add(mjGEOM_BOX, {0.0105, 0.006, 0.5 * (tip - hand_bottom)}, closed,
        closed + Eigen::Vector3d(0, side * 0.04, 0));
  }
  add(mjGEOM_CYLINDER, {0.044, 0.0125, 0}, flange, flange);
  return shape;
}

}  // namespace flowscope
