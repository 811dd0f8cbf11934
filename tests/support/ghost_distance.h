// How far a ghost of the gripper lies from the gripper itself.
#pragma once

#include <mujoco/mujoco.h>

#include <algorithm>

#include "recorder/world.h"
#include "render/gripper_shape.h"

namespace flowscope::testing {

/// Largest distance, metres, from a part of the ghost to the nearest geom of its kind and size in the world.
inline double apart(const World& world, const GripperShape& shape) {
  const mjModel* model = world.model();
  const Pose world_from_tool = world.frame().world_from_tool;
  double largest = 0;
  for (const GripperShape::Part& part : shape.parts) {
    const Pose ghost = world_from_tool * tool_from_part(part, world.frame().openness);
    double nearest = 1;
    for (int geom = 0; geom < model->ngeom; ++geom) {
      const Eigen::Map<const Eigen::Vector3d> size(model->geom_size + 3 * geom);
      if (model->geom_type[geom] != part.type || size != part.half_size) continue;
      const Eigen::Map<const Eigen::Vector3d> position(world.data()->geom_xpos + 3 * geom);
      nearest = std::min(nearest, (position - ghost.position).norm());
    }
    largest = std::max(largest, nearest);
  }
  return largest;
}

}  // namespace flowscope::testing
