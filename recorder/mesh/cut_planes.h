// Where cutting a shape may make its parts more convex.
#pragma once

#include "recorder/mesh/mesh_cut.h"

namespace flowscope {

/// An edge where the surface turns inwards.
struct Crease {
  Eigen::Vector3d from, to;
  double turn = 0;              ///< 1 - cosine of the angle between the faces' normals
  std::array<Plane, 2> planes;  ///< of its faces
};
std::vector<Crease> creases_of(const TriangleMesh& mesh);

/// Planes of the faces at those creases that run inside the part, the sharpest and longest first, then planes
/// across the axes of space and of the part, evenly spread. The same for a shape at any scale.
std::vector<Plane> planes_to_try(const CutMesh& part, const std::vector<Crease>& creases);

}  // namespace flowscope
