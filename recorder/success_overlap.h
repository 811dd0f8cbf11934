// Does any part of an object lie in a sensor's box? Exact for MuJoCo's convex shapes, without contacts.
#pragma once

#include "render/pose.h"

struct mjModel_;
struct mjData_;

namespace flowscope {

struct SensorBox {
  Pose world_from_box;
  Eigen::Vector3d half_size{0, 0, 0};  ///< metres
};

/// The box of a site of type box at the present moment.
SensorBox sensor_box(const mjModel_* model, const mjData_* data, int site);
/// Geom against box: sphere, capsule, ellipsoid, cylinder, box, and the convex hull of a mesh. Never true for
/// planes and height fields. Needs the data's kinematics up to date. Touching within about a micrometre may
/// go either way.
bool overlaps(const mjModel_* model, const mjData_* data, int geom, const SensorBox& box);
/// Any geom of the body (not of its children).
bool body_overlaps(const mjModel_* model, const mjData_* data, int body, const SensorBox& box);
/// How far the nearest geom of the body is from the box, metres; negative: how deep the deepest is in it, as
/// the shortest way out. Infinite for a body without such geoms.
double body_gap(const mjModel_* model, const mjData_* data, int body, const SensorBox& box);

}  // namespace flowscope
