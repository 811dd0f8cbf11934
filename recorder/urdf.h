// URDF files, made ready for the simulator: it reads few kinds of meshes, drops what is only to be seen, and
// does not survive some mistakes.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "recorder/scene_source.h"

namespace flowscope {

struct OpenedUrdf {
  PlacedText text;
  std::vector<std::pair<std::string, std::string>> files;  ///< bare name and bytes, which the text refers to
  std::map<std::string, std::string> skins;                ///< the picture, one of `files`, of each mesh
};

/// Visual shapes and massless frames are kept, unless the file says otherwise itself (<mujoco>). Meshes are
/// looked for where it names them, from its folder, or for package:// from there upwards, or else beside it;
/// kinds that the simulator does not read become ones that it does, with their colours. `note` hears of what
/// could not be taken over. Throws SceneError: for what xacro should have resolved, for unknown kinds of
/// joints, and for meshes that are missing (all of them) or broken.
OpenedUrdf opened_urdf(const SceneSource& urdf, const std::function<void(const std::string&)>& note);

/// An MJCF made of that: meshes get their skins, and collision shapes are not drawn where a body has visual
/// ones.
std::string dressed_urdf(const std::string& mjcf, const std::map<std::string, std::string>& skins);

}  // namespace flowscope
