// A user's own scene, found again by what a demonstration's file says of it.
#pragma once

#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>

#include "recorder/scene_task.h"

namespace flowscope {

/// The scene cannot be opened as it was; what() names the file that is missing or has changed.
class SceneLost : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What a scene opened by this call says of itself: `raw_model` is the model before anything was added to it,
/// `robot_file` the description, empty where it is one of ours.
SceneOrigin scene_origin(const SceneCall& call, const mjModel_* raw_model,
                         const std::filesystem::path& robot_file);

/// Relative names are looked up in the folder of that time, then in the present one. Throws SceneLost.
std::shared_ptr<const Task> open_again(const SceneOrigin& origin, const std::filesystem::path& assets);

}  // namespace flowscope
