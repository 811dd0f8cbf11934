#include "recorder/scene_origin.h"

#include "recorder/model_sha256.h"
#include "recorder/scene_files.h"
#include "recorder/sha256.h"

namespace flowscope {
namespace {

namespace fs = std::filesystem;

std::string file_sha256(const fs::path& file) {
  const std::string text = read_text(file);
  return sha256_hex({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

/// Throws SceneLost unless the file is there.
fs::path existing(const fs::path& file, const std::string& what) {
  std::error_code none;
  if (!fs::is_regular_file(file, none))
    throw SceneLost(file.string() + ", " + what + ", is not there any more");
  return file;
}

std::shared_ptr<const Task> open_in(const fs::path& folder, const SceneOrigin& origin,
                                    const fs::path& assets) {
  SceneCall call{existing(folder / origin.scene, "the scene that it was recorded in"), origin.robot, ""};
  if (!origin.robot_sha256.empty()) {
    const fs::path robot = existing(folder / origin.robot, "the description of its robot");
    if (file_sha256(robot) != origin.robot_sha256) {
      throw SceneLost(robot.string() + ", the description of its robot, has changed since");
    }
    call.robot = robot.string();
  }
  call.key = origin.key;
  std::shared_ptr<const Task> task;
  try {
    task = open_scene(call, assets);
  } catch (const BadScript& error) {
    throw SceneLost(std::string("its scene cannot be opened any more: ") + error.what());
  }
  if (task->origin().scene->scene_sha256 != origin.scene_sha256) {
    throw SceneLost(call.scene.string() +
                    ", the scene that it was recorded in, has changed since (it or a file that it takes in)");
  }
  return task;
}

}  // namespace

SceneOrigin scene_origin(const SceneCall& call, const mjModel_* raw_model, const fs::path& robot_file) {
  SceneOrigin origin{call.scene.string(), call.robot, "", model_sha256(raw_model), ""};
  origin.key = call.key;
  if (!robot_file.empty()) origin.robot_sha256 = file_sha256(robot_file);
  if (call.scene.is_relative() || (!robot_file.empty() && robot_file.is_relative())) {
    origin.folder = fs::current_path().string();
  }
  return origin;
}

std::shared_ptr<const Task> open_again(const SceneOrigin& origin, const fs::path& assets) {
  try {
    return open_in(origin.folder, origin, assets);
  } catch (const SceneLost&) {
    std::error_code none;
    if (origin.folder.empty() || !fs::is_regular_file(origin.scene, none)) throw;
    return open_in("", origin, assets);  // moved together with the folder that it was recorded from
  }
}

}  // namespace flowscope
