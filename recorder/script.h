// The waypoint script of the contract: one grammar for tasks and users.
#pragma once

#include <optional>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include "render/pose.h"

namespace flowscope {

/// Input that cannot be used; what() starts with "<file>:<line>:<column>: ".
class BadScript : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A place in a text, counted from 1; 0: not known.
struct TextPlace {
  int line = 0, column = 0;
};

struct MoveStep {
  std::string frame = "world";  ///< world, tool, or any body or site of the scene
  Pose frame_from_tool;         ///< the wanted tool pose in that frame at the moment the step starts
  bool linear = false;          ///< path: linear; else planned, collision-free
  bool ignore_collisions = false;
  /// Rotations about the frame's z that are as good: N-fold (0: any yaw). The one nearest to the tool's yaw
  /// is taken, so that a demonstration never depends on a turn that no picture shows.
  int yaw_symmetry = 1;
  TextPlace frame_place = {};  ///< of `frame`, or of the move where none is given
};
struct GripperStep {
  double openness = 0;  ///< 0 closed … 1 open; closing grasps, opening releases
};
struct Step {
  std::variant<MoveStep, GripperStep> what;
  int line = 0;  ///< in the script's text, for messages
};

struct Script {
  std::string task;  ///< may be empty: the current scene
  std::vector<Step> steps;
  std::string file = "script";  ///< where the text comes from, for messages
  TextPlace task_place = {};
};

/// Throws BadScript for anything that is not the grammar: unknown keys, wrong types, not YAML, too many steps
/// (10 000).
Script parse_script(const std::string& text, const std::string& file_name = "script");

}  // namespace flowscope
