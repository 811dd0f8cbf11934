#include "recorder/script_poses.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "recorder/world.h"

namespace flowscope {
namespace {

Pose turned(double yaw_rad) {
  return {Eigen::Vector3d::Zero(), Eigen::Quaterniond(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()))};
}

/// Among the yaws that the step calls as good, the one with the least turn from the tool's present rotation.
double nearest_yaw(const Pose& world_from_frame, const MoveStep& move, const Eigen::Quaterniond& present) {
  const auto cosine_at = [&](double yaw) {
    return (world_from_frame * turned(yaw) * move.frame_from_tool).rotation.dot(present);
  };
  if (move.yaw_symmetry == 0) {
    // The cosine of half the turn is a cos(yaw / 2) + b sin(yaw / 2); its largest magnitude is the least
    // turn.
    const double a = cosine_at(0), b = (world_from_frame.rotation * Eigen::Quaterniond(0, 0, 0, 1) *
                                        move.frame_from_tool.rotation)
                                           .dot(present);
    return 2 * std::atan2(b, a);
  }
  double best = 0, best_cosine = std::abs(cosine_at(0));
  for (int k = 1; k < move.yaw_symmetry; ++k) {
    const double yaw = 2 * std::numbers::pi * k / move.yaw_symmetry;
    // A hair better is no better: equal choices must not hang on rounding.
    if (std::abs(cosine_at(yaw)) > best_cosine + 1e-9) {
      best = yaw;
      best_cosine = std::abs(cosine_at(yaw));
    }
  }
  return best;
}

}  // namespace

PlacedMove place_move(const World& world, const MoveStep& move, const Pose& present) {
  const Pose frame = move.frame == "tool" ? present : world.world_from(move.frame);
  const Pose base = frame * turned(nearest_yaw(frame, move, present.rotation));
  return {base * move.frame_from_tool, base};
}

std::vector<PlacedMove> place_choices(const World& world, const MoveStep& move, const Pose& present) {
  const PlacedMove first = place_move(world, move, present);
  const int count = move.yaw_symmetry == 0 ? 12 : move.yaw_symmetry;
  std::vector<PlacedMove> choices;
  for (int k = 0; k < count; ++k) {
    const Pose base = first.world_from_base * turned(2 * std::numbers::pi * k / count);
    choices.push_back({base * move.frame_from_tool, base});
  }
  std::stable_sort(choices.begin() + 1, choices.end(), [&](const PlacedMove& a, const PlacedMove& b) {
    return rotation_error_rad(a.world_from_tool, present) < rotation_error_rad(b.world_from_tool, present);
  });
  return choices;
}

std::vector<PlacedStep> place_script(const World& world, const Script& script, const Pose& tool,
                                     double openness) {
  std::vector<PlacedStep> placed;
  Pose present = tool;
  for (const Step& step : script.steps) {
    PlacedStep& now = placed.emplace_back();
    now.step = step;
    if (const auto* gripper = std::get_if<GripperStep>(&step.what)) {
      openness = gripper->openness;
    } else {
      try {
        now.move = place_move(world, std::get<MoveStep>(step.what), present);
        present = now.move->world_from_tool;
      } catch (const std::invalid_argument& error) {
        now.problem = error.what();
      }
    }
    now.openness = openness;
  }
  return placed;
}

}  // namespace flowscope
