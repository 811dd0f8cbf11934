// Where the waypoints of a script lie in the world as it stands.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "recorder/script.h"

namespace flowscope {

class World;

/// What a move step means now: world_from_tool = world_from_base * move.frame_from_tool. The base is the
/// step's frame, turned by the yaw that was chosen among those that are as good.
struct PlacedMove {
  Pose world_from_tool, world_from_base;
};
/// `present`: the tool's pose when the step starts; it decides the yaw and is what the frame `tool` means.
/// Throws std::invalid_argument for an unknown frame, with the known ones.
PlacedMove place_move(const World& world, const MoveStep& move, const Pose& present);
/// place_move's and those with the other yaws that are as good (of any yaw twelve), the least turn first.
std::vector<PlacedMove> place_choices(const World& world, const MoveStep& move, const Pose& present);

/// One step of a script as it would be if it ran now.
struct PlacedStep {
  Step step;
  std::optional<PlacedMove> move;  ///< empty for gripper steps and where `problem` says why
  double openness = 1;             ///< of the fingers at the step's end
  std::string problem;
};
/// All steps in order, each starting where the one before ends; nothing moves meanwhile.
std::vector<PlacedStep> place_script(const World& world, const Script& script, const Pose& tool,
                                     double openness);

}  // namespace flowscope
