// Compiling scene files. Those of assets/robots and assets/scenes are found by their bare names wherever a
// scene lies that has none of its own by that name, and so are meshes and pictures of objects that have a
// folder beside it (mug/mug.xml).
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "recorder/scene_source.h"
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
  /// MJCF or URDF. Throws SceneError at the place where the author of the file finds what is wrong.
  ModelPtr compile(const std::filesystem::path& file) const;
  /// A text made of the scene `source`, as if it lay beside that.
  ModelPtr compile(const PlacedText& text, const SceneSource& source) const;
  /// With what it includes; throws SceneError.
  SceneSource source(const std::filesystem::path& scene) const;

 private:
  struct Loaded {
    ModelPtr model;
    std::string message;  ///< where there is no model
  };
  Loaded load(const std::filesystem::path& file) const;
  Loaded load(const std::string& text, const std::filesystem::path& folder) const;
  void prefer_own(const SceneSource& source) const;
  SceneError trouble(const std::filesystem::path& file, const std::string& message) const;

  std::unique_ptr<mjVFS_> files_;
  std::map<std::string, std::filesystem::path> shared_;  ///< by bare name
};

}  // namespace flowscope
