// glTF 2.0 as one mesh. Our own reader: the library's drops in silence what it does not know.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>

#include "recorder/mesh/gltf_extensions.h"
#include "recorder/mesh/mesh.h"

namespace flowscope {

/// All triangles of the file's scene in its own units and axes, as read_mesh colours them. Nothing for files
/// of version 1. Throws BadGltf.
std::optional<TriangleMesh> read_gltf(const std::filesystem::path& file, const TellLoss& tell,
                                      const std::function<void()>& now_pictures);

}  // namespace flowscope
