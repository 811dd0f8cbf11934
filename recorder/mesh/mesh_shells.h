// A closed mesh as the closed surfaces that it consists of.
#pragma once

#include "recorder/mesh/mesh.h"

namespace flowscope {

/// Its shells, each closed with its outside out: legs and seat of a chair that were modelled one by one.
/// Empty where there is but one, where there are more than `most`, or where a shell bounds a hollow or is
/// not closed by itself; the mesh is one shape then. Colours are dropped.
std::vector<TriangleMesh> shells_of(const TriangleMesh& mesh, std::size_t most);

}  // namespace flowscope
