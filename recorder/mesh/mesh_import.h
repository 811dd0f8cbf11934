// Mesh files of a user's own, read by assimp, glTF 2.0 by our own reader. From this machine's disk only, and
// only from beside the file itself.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>

#include "recorder/mesh/mesh.h"

namespace flowscope {

/// what() begins with the file.
class BadMesh : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct MeshImportOptions {
  double metres_per_unit = 1;
  /// Which axis of the file points up; without a word y for glTF and COLLADA (the reader turns those to y), z
  /// for the rest.
  std::optional<char> up{};
  /// Hears of everything that could not be taken over (a texture, an extension), for people; each line begins
  /// with the file.
  std::function<void(const std::string&)> leave_out{};
};

/// All triangles of a .gltf, .glb, .dae, .obj, .ply or .stl file in one mesh: metres, z up, coloured by its
/// materials' base colours and their textures, else by its vertices and materials. Not tidied. Throws BadMesh
/// for a file that can not be read, needs an extension that is not read, is too large, holds no triangles or
/// numbers that are not finite.
TriangleMesh read_mesh(const std::filesystem::path& file, const MeshImportOptions& options);

}  // namespace flowscope
