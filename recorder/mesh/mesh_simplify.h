// A mesh with fewer triangles, for searches that need not see every one.
#pragma once

#include "recorder/mesh/mesh.h"

namespace flowscope {

/// Edges are drawn together where that moves the surface least (Garland and Heckbert's quadrics) until at
/// most so many triangles are left, or no edge can go without folding the surface. A closed mesh stays
/// closed, thin walls and holes stay open. Colours are dropped.
TriangleMesh simplified(const TriangleMesh& mesh, std::size_t most_triangles);

}  // namespace flowscope
