// Convex parts that are boxes: the simulator stacks those better than meshes.
#pragma once

#include <optional>

#include "recorder/mesh/mesh.h"

namespace flowscope {

struct FittedBox {
  Pose world_from_box;                 ///< in the mesh's own frame
  Eigen::Vector3d half_size{0, 0, 0};  ///< metres
};

/// The box along the largest face's normal that holds a convex mesh, if the mesh fills it to within half a
/// percent.
std::optional<FittedBox> fitted_box(const TriangleMesh& hull);

}  // namespace flowscope
