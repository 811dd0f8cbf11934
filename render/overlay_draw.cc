#include "render/overlay_draw.h"

#include <algorithm>
#include <cstddef>

namespace flowscope {

namespace {

using RowMatrix = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

/// Next free geom of the scene, or null when its buffer is full.
mjvGeom* add_geom(mjvScene& scene, int type, const Eigen::Vector3d& half_size_m, const Pose& world_from_geom,
                  const Rgba& color) {
  if (scene.ngeom >= scene.maxgeom) return nullptr;
  mjvGeom* geom = scene.geoms + scene.ngeom++;
  const RowMatrix rotation = world_from_geom.rotation.toRotationMatrix();
  mjv_initGeom(geom, type, half_size_m.data(), world_from_geom.position.data(), rotation.data(),
               color.data());
  // Mostly its own light, so that a colour keeps its meaning; the rest of it is shading that shows the shape.
  geom->emission = 0.7f;
  geom->specular = 0;
  return geom;
}

void add_connector(mjvScene& scene, int type, double radius_m, const Eigen::Vector3d& from,
                   const Eigen::Vector3d& to, const Rgba& color) {
  if ((to - from).norm() < 1e-7) return;
  mjvGeom* geom = add_geom(scene, type, Eigen::Vector3d::Zero(), Pose{}, color);
  if (geom == nullptr) return;
  mjv_makeConnector(geom, type, radius_m, from.x(), from.y(), from.z(), to.x(), to.y(), to.z());
}

Rgba blend(const Rgba& first, const Rgba& last, float t) {
  Rgba color;
  for (std::size_t i = 0; i < color.size(); ++i) color[i] = (1 - t) * first[i] + t * last[i];
  return color;
}

void append_line(const OverlayLine& line, std::size_t stride, mjvScene& scene) {
  const std::size_t last = line.points.size() - 1;
  const Rgba end = line.color_end == Rgba{} ? line.color : line.color_end;
  for (std::size_t i = 0; i < last; i += stride) {
    const std::size_t next = std::min(i + stride, last);
    if (!line.points[i].allFinite() || !line.points[next].allFinite()) continue;
    const float middle = 0.5f * static_cast<float>(i + next) / static_cast<float>(last);
    add_connector(scene, mjGEOM_CAPSULE, 0.5 * line.width_m, line.points[i], line.points[next],
                  blend(line.color, end, middle));
  }
}

void append_frame(const OverlayFrame& frame, mjvScene& scene) {
  const Eigen::Vector3d origin = frame.world_from_frame.position;
  for (int axis = 0; axis < 3; ++axis) {
    Rgba color{0.1f, 0.1f, 0.1f, frame.alpha};
    color[static_cast<std::size_t>(axis)] = 0.9f;
    const Eigen::Vector3d tip = frame.world_from_frame * (Eigen::Vector3d::Unit(axis) * frame.length_m);
    add_connector(scene, mjGEOM_CAPSULE, 0.05 * frame.length_m, origin, tip, color);
  }
}

void append_ghost(const OverlayGhost& ghost, const GripperShape& gripper, mjvScene& scene) {
  for (const GripperShape::Part& part : gripper.parts) {
    mjvGeom* geom = add_geom(scene, part.type, part.half_size,
                             ghost.world_from_tool * tool_from_part(part, ghost.openness), ghost.color);
    if (geom != nullptr && part.mesh >= 0) geom->dataid = 2 * part.mesh;  // odd numbers are convex hulls
  }
}

}  // namespace

void light_solids(mjvScene& scene) {
  mjvLight light{};
  light.headlight = light.directional = 1;
  light.dir[2] = -1;
  light.attenuation[0] = 1;
  light.cutoff = 180;
  std::fill(std::begin(light.diffuse), std::end(light.diffuse), 0.35f);
  scene.lights[0] = light;
  scene.nlight = 1;
}

void append_solids(const Overlay& overlay, const GripperShape& gripper, mjvScene& scene) {
  constexpr std::size_t segment_limit = overlay_geom_limit * 3 / 8;
  std::size_t points = 0;
  for (const OverlayLine& line : overlay.lines) points += line.points.size();
  const std::size_t stride = 1 + points / segment_limit;
  for (const OverlayLine& line : overlay.lines) {
    if (line.points.size() > 1) append_line(line, stride, scene);
  }
  for (const OverlayFrame& frame : overlay.frames) append_frame(frame, scene);
  for (const OverlayGhost& ghost : overlay.ghosts) append_ghost(ghost, gripper, scene);
}

}  // namespace flowscope
