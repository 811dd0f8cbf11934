// Where a demonstration comes from, as far as its file says.
#pragma once

#include <optional>
#include <string>

namespace flowscope {

/// A user's own scene: what `--scene FILE --robot FILE` opened.
struct SceneOrigin {
  std::string scene;         ///< its file, as it was given
  std::string robot;         ///< the robot's description, as it was given: a file, or the name of one of ours
  std::string folder;        ///< the working folder of that time, where relative names are found
  std::string scene_sha256;  ///< of the compiled scene: its file, what it includes, meshes, pictures
  std::string robot_sha256;  ///< of the description's file; empty where it is one of ours
  std::string key{};         ///< the key frame that it was told to begin with; empty: none was named
  bool operator==(const SceneOrigin&) const = default;
};

/// A regular value. Files of older builds say nothing of all this.
struct DemoOrigin {
  std::string robot;                 ///< name of its description (panda, ur5); empty: not recorded
  int joints = 0;                    ///< of its arm; 0: not recorded
  std::optional<SceneOrigin> scene;  ///< none: a task, or not recorded
  bool operator==(const DemoOrigin&) const = default;
};

}  // namespace flowscope
