// The materials of a Wavefront OBJ file: colours, pictures and how these lie on the mesh.
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "recorder/mesh/mesh.h"

namespace flowscope {

struct ObjMaterial {
  std::optional<std::array<float, 3>> color{};  ///< Kd, as shown
  std::string picture;                          ///< map_Kd as it is written; empty: none
  Eigen::Vector2f scale{1, 1}, offset{0, 0};    ///< of texture coordinates, map_Kd's -s and -o

  Eigen::Vector2f place(const Eigen::Vector2f& corner) const { return scale.cwiseProduct(corner) + offset; }
};

/// By name, of the file's material libraries, which lie beside it. Tells of libraries that are not there, of
/// materials that none of them defines and of what is not taken over.
std::map<std::string, ObjMaterial> obj_materials(const std::filesystem::path& file,
                                                 const std::function<void(const std::string&)>& tell);

}  // namespace flowscope
