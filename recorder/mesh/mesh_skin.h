// All colours and textures of a mesh in one picture: the simulator paints an object with one.
#pragma once

#include "recorder/mesh/mesh.h"

namespace flowscope {

struct MeshSkin {
  ImageRgb picture;                      ///< empty with a single plain colour
  std::vector<TextureCorners> corners;   ///< of each triangle, u right, v up; none without a picture
  std::size_t colors = 0, textures = 0;  ///< plain ones; pictures of the mesh that are seen
};

/// A mesh of plain colours gets a palette. One texture over all of it stays as it is, and is repeated where
/// the mesh does. Otherwise textures and palette stand in a square of cells, at most 4096 pixels wide; there
/// a triangle over more than four repeats of its texture has the texture's mean colour.
MeshSkin skin_of(const TriangleMesh& mesh);

}  // namespace flowscope
