// A user's own scene as a task: any MJCF or URDF, without a task.yaml. One variation, no lots to draw, no
// success terms: a script that ends without failure counts as done.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "recorder/task.h"

namespace flowscope {

struct SceneCall {
  std::filesystem::path scene;
  std::string robot;        ///< description's file or the name of one of ours; empty: for viewing only
  std::string instruction;  ///< empty: the words of the scene's name, for a policy must read something
};

/// The scene's name is the file's, with everything but letters, digits, _ and - replaced. What it lacks is
/// added (scene_edit.h); a key frame in it is the posture it begins with. Throws BadScript that names the
/// file, for a scene or description that cannot be used.
std::shared_ptr<const Task> open_scene(const SceneCall& call, const std::filesystem::path& assets);

}  // namespace flowscope
