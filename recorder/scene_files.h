// Compiling scene files. Those of assets/robots and assets/scenes are found by their bare names wherever a
// scene lies, and so are meshes and pictures of objects that have a folder beside it (mug/mug.xml).
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "render/mujoco_owners.h"

struct mjVFS_;

namespace flowscope {

class SceneFiles {
 public:
  /// Throws std::runtime_error when a shared file cannot be read or two have one name.
  explicit SceneFiles(const std::filesystem::path& assets);
  ~SceneFiles();
  SceneFiles(const SceneFiles&) = delete;
  SceneFiles& operator=(const SceneFiles&) = delete;

  /// From now on `name` (no folders) is this text, whatever lies on the disk. False when the name is taken.
  bool add(const std::string& name, const std::string& text);
  /// MJCF or URDF; a file of that name that was added comes first. Throws std::runtime_error with the file's
  /// name and MuJoCo's message.
  ModelPtr compile(const std::filesystem::path& file) const;

 private:
  std::unique_ptr<mjVFS_> files_;
};

/// The whole file; throws std::runtime_error that names it.
std::string read_text(const std::filesystem::path& file);

}  // namespace flowscope
