#include "recorder/formats/frame_actions.h"

#include <cmath>
#include <numbers>

namespace flowscope {
namespace {

/// Fingers that move less than this in a frame stand still: they hold something, or wait.
constexpr double openness_at_rest = 0.01;

Eigen::Vector3d rotation_vector(const Eigen::Quaterniond& rotation) {
  const Eigen::AngleAxisd turn(rotation);
  return turn.angle() * turn.axis();
}

/// A tool that points down is half a turn away from the world's axes, where the shortest vector jumps between
/// two opposite ones from frame to frame.
Eigen::Vector3d nearest_rotation_vector(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& before) {
  const Eigen::Vector3d shortest = rotation_vector(rotation);
  const double angle = shortest.norm();
  if (angle < 1e-9) return shortest;
  const Eigen::Vector3d other = shortest * (1 - 2 * std::numbers::pi / angle);
  return (other - before).norm() < (shortest - before).norm() ? other : shortest;
}

/// The first of two opposite half turns: the one whose largest part is positive.
Eigen::Vector3d first_rotation_vector(const Eigen::Quaterniond& rotation) {
  Eigen::Index largest = 0;
  const Eigen::Vector3d shortest = rotation_vector(rotation);
  shortest.cwiseAbs().maxCoeff(&largest);
  return nearest_rotation_vector(rotation,
                                 shortest[largest] < 0 && shortest.norm() > 3 ? -shortest : shortest);
}

Eigen::Vector3d clip(const Eigen::Vector3d& step, bool& clipped) {
  const Eigen::Vector3d inside = step.cwiseMax(-1).cwiseMin(1);
  clipped = clipped || inside != step;
  return inside;
}

}  // namespace

std::vector<FrameAction> frame_actions(const std::vector<Frame>& frames) {
  std::vector<FrameAction> actions;
  for (std::size_t t = 0; t + 1 < frames.size(); ++t) {
    const Frame &from = frames[t], &to = frames[t + 1];
    const Eigen::Quaterniond rotation = to.world_from_tool.rotation;
    FrameAction action;
    action.target = to.world_from_tool;
    action.rotation_vector = actions.empty()
                                 ? first_rotation_vector(rotation)
                                 : nearest_rotation_vector(rotation, actions.back().rotation_vector);
    action.position_step = clip(
        (to.world_from_tool.position - from.world_from_tool.position) / action_position_m, action.clipped);
    action.rotation_step =
        clip(rotation_vector(rotation * from.world_from_tool.rotation.conjugate()) / action_rotation_rad,
             action.clipped);
    const double opening = to.openness - from.openness;
    if (std::abs(opening) > openness_at_rest) {
      action.gripper = opening > 0 ? -1 : 1;
    } else {
      action.gripper = actions.empty() ? (from.gripper_open ? -1 : 1) : actions.back().gripper;
    }
    actions.push_back(action);
  }
  return actions;
}

}  // namespace flowscope
