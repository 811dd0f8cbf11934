// A coloured mesh as the two files a picture of it needs.
#pragma once

#include <string>

#include "recorder/mesh/mesh.h"
#include "render/image.h"

namespace flowscope {

/// Wavefront OBJ with a normal for each corner: smooth across edges up to 40 degrees. With more than one
/// colour, or a texture, each corner has its place in `skin`.
struct MeshPicture {
  std::string obj;
  ImageRgb skin;  ///< empty with a single plain colour
  std::size_t colors = 0, textures = 0;
};
MeshPicture picture_of(const TriangleMesh& mesh);
/// Corners and triangles only.
std::string plain_obj(const TriangleMesh& mesh);

}  // namespace flowscope
