// A shape as a few convex parts, for collisions: cut where that takes most away from the hulls, then put
// together again what is convex together (after Mamou's hierarchical decompositions; planes are tried on a
// coarse copy).
#pragma once

#include "recorder/mesh/mesh.h"

namespace flowscope {

struct PartOptions {
  int most_parts = 16;
  double concavity = 0.02;  ///< enough when the hulls' volume exceeds the mesh's by this fraction
  int most_corners = 200;   ///< of each part
};

/// Closed convex meshes, each with some volume. Exact cuts for closed meshes; an open one is cut as a sheet.
/// Empty when the mesh lies in a plane.
std::vector<TriangleMesh> convex_parts(const TriangleMesh& mesh, const PartOptions& options);

}  // namespace flowscope
