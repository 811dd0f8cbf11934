// A shape as a few convex parts, for collisions: cut where that takes most away from the hulls, then put
// together again what is convex together (after Mamou's hierarchical decompositions; planes are tried on a
// coarse copy).
#pragma once

#include <functional>

#include "recorder/mesh/mesh.h"

namespace flowscope {

struct PartOptions {
  int most_parts = 32;
  double concavity = 0.02;  ///< enough when the hulls' volume exceeds the mesh's by this fraction
  int most_corners = 200;   ///< of each part
  /// Hears of each cut how much of the work is done at most.
  std::function<void(int done, int of)> progress{};
};

/// Closed convex meshes, each with some volume; the same for a shape at any scale. A closed mesh is cut until
/// the hulls are near enough or the parts are used up, an open one as a sheet while cuts gain something.
/// Empty when the mesh lies in a plane.
std::vector<TriangleMesh> convex_parts(const TriangleMesh& mesh, const PartOptions& options);

}  // namespace flowscope
