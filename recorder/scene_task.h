// A user's own scene as a task: any MJCF or URDF, without a task.yaml. One variation, no lots to draw, no
// success terms: a script that ends without failure counts as done.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "recorder/task.h"

namespace flowscope {

struct SceneCall {
  std::filesystem::path scene;
  std::string robot;        ///< description's file or the name of one of ours; empty: for viewing only
  std::string instruction;  ///< empty: the words of the scene's name, for a policy must read something
  /// The key frame that it begins with: its name, or its number from 0. Empty: the first, if there is one.
  std::string key{};
  /// Hears what people should know of a scene that opens all the same.
  std::function<void(const std::string&)> note{};
};

/// The scene's name is the file's, with everything but letters, digits, _ and - replaced. What it lacks is
/// added (scene_edit.h). It begins with its key frame (scene_start.h), the robot at its home. What is open
/// for viewing only, or begins in the middle of a movement, does not settle. Throws BadScript that names the
/// file, for a scene or description that cannot be used.
std::shared_ptr<const Task> open_scene(const SceneCall& call, const std::filesystem::path& assets);

}  // namespace flowscope
