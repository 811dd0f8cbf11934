// What the simulator says against a scene, told at the place where its author finds it.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "recorder/scene_source.h"

namespace flowscope {

/// `said` is MuJoCo's message about a text whose lines were read at `lines`; without them, or for an object
/// without a line, the place is that of the object with the name which the message gives.
SceneError scene_trouble(const std::string& said, const SceneSource& source,
                         const std::vector<XmlPlace>& lines);

/// One line "<file>:<line>: …" for each mesh, picture and height field that an MJCF names and that is not
/// there; empty when all are. `is_shared` knows files by their bare names.
std::string missing_files(const SceneSource& source,
                          const std::function<bool(const std::string& name)>& is_shared);

}  // namespace flowscope
