#include "recorder/success_overlap.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <array>
#include <limits>

#include "recorder/convex_gap.h"

namespace flowscope {
namespace {

using Eigen::Vector3d;

/// Farthest point of the geom along `direction`, both in the geom's own frame.
Vector3d geom_support(const mjModel* model, int geom, const Vector3d& direction) {
  const mjtNum* size = model->geom_size + 3 * geom;
  const auto sign = [](double x) { return x < 0 ? -1.0 : 1.0; };
  switch (model->geom_type[geom]) {
    case mjGEOM_SPHERE:
      return size[0] * direction.normalized();
    case mjGEOM_CAPSULE:
      return size[0] * direction.normalized() + Vector3d(0, 0, sign(direction.z()) * size[1]);
    case mjGEOM_ELLIPSOID: {
      const Vector3d radii(size[0], size[1], size[2]);
      const Vector3d scaled = radii.cwiseProduct(direction).normalized();
      return radii.cwiseProduct(scaled);
    }
    case mjGEOM_CYLINDER: {
      const Vector3d flat(direction.x(), direction.y(), 0);
      const Vector3d rim = flat.norm() > 1e-12 ? Vector3d(size[0] * flat.normalized()) : Vector3d::Zero();
      return rim + Vector3d(0, 0, sign(direction.z()) * size[1]);
    }
    case mjGEOM_BOX:
      return {sign(direction.x()) * size[0], sign(direction.y()) * size[1], sign(direction.z()) * size[2]};
    default: {
      const int mesh = model->geom_dataid[geom];
      const float* vertex = model->mesh_vert + 3 * model->mesh_vertadr[mesh];
      Vector3d best = Vector3d::Zero();
      double farthest = -mjMAXVAL;
      for (int i = 0; i < model->mesh_vertnum[mesh]; ++i, vertex += 3) {
        const Vector3d point(vertex[0], vertex[1], vertex[2]);
        if (point.dot(direction) > farthest) {
          farthest = point.dot(direction);
          best = point;
        }
      }
      return best;
    }
  }
}

/// Gilbert-Johnson-Keerthi: grows a simplex of the Minkowski difference towards the origin. `simplex` keeps
/// its newest point last; reduces it to the part nearest the origin and turns `direction` towards the origin.
bool advance_simplex(std::array<Vector3d, 4>& simplex, int& count, Vector3d& direction) {
  const auto towards = [](const Vector3d& a, const Vector3d& b) { return a.dot(b) > 0; };
  const Vector3d a = simplex[static_cast<std::size_t>(count - 1)];
  const auto line = [&](const Vector3d& b) {
    const Vector3d ab = b - a;
    if (towards(ab, -a)) {
      simplex = {b, a};
      count = 2;
      direction = ab.cross(-a).cross(ab);
      if (direction.squaredNorm() < 1e-24) direction = ab.unitOrthogonal();
    } else {
      simplex = {a};
      count = 1;
      direction = -a;
    }
  };
  const auto triangle = [&](const Vector3d& b, const Vector3d& c) {
    const Vector3d ab = b - a, ac = c - a, normal = ab.cross(ac);
    if (towards(normal.cross(ac), -a)) {
      towards(ac, -a) ? line(c) : line(b);
    } else if (towards(ab.cross(normal), -a)) {
      line(b);
    } else if (towards(normal, -a)) {
      simplex = {c, b, a};
      count = 3;
      direction = normal;
    } else {
      simplex = {b, c, a};
      count = 3;
      direction = -normal;
    }
  };
  if (count == 2) {
    line(simplex[0]);
    return false;
  }
  if (count == 3) {
    triangle(simplex[1], simplex[0]);
    return false;
  }
  // A tetrahedron whose base (simplex[2], [1], [0]) looks away from the origin's side: test the three new
  // faces.
  const Vector3d b = simplex[2], c = simplex[1], d = simplex[0];
  if (towards((b - a).cross(c - a), -a)) {
    triangle(b, c);
    return false;
  }
  if (towards((c - a).cross(d - a), -a)) {
    triangle(c, d);
    return false;
  }
  if (towards((d - a).cross(b - a), -a)) {
    triangle(d, b);
    return false;
  }
  return true;
}

bool intersect(const Support& first, const Support& second) {
  const auto difference = [&](const Vector3d& direction) -> Vector3d {
    return first(direction) - second(-direction);
  };
  Vector3d direction(1, 0, 0);
  std::array<Vector3d, 4> simplex{difference(direction)};
  int count = 1;
  direction = -simplex[0];
  for (int i = 0; i < 64; ++i) {
    if (direction.squaredNorm() < 1e-24) return true;  // the origin lies on the simplex
    const Vector3d point = difference(direction);
    if (point.dot(direction) < 0) return false;
    simplex[static_cast<std::size_t>(count++)] = point;
    if (advance_simplex(simplex, count, direction)) return true;
  }
  return false;  // grazing within rounding
}

bool has_volume(const mjModel* model, int geom) {
  const int type = model->geom_type[geom];
  return type != mjGEOM_PLANE && type != mjGEOM_HFIELD;
}

Support points_of(const mjModel* model, const mjData* data, int geom) {
  const Vector3d position = Eigen::Map<const Vector3d>(data->geom_xpos + 3 * geom);
  const mjtNum* m = data->geom_xmat + 9 * geom;
  Eigen::Matrix3d rotation;
  rotation << m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8];
  return [=](const Vector3d& d) -> Vector3d {
    return rotation * geom_support(model, geom, rotation.transpose() * d) + position;
  };
}

Support points_of(const SensorBox& box) {
  const Eigen::Matrix3d rotation = box.world_from_box.rotation.toRotationMatrix();
  return
      [=, half_size = box.half_size, position = box.world_from_box.position](const Vector3d& d) -> Vector3d {
        const Vector3d local = rotation.transpose() * d;
        const Vector3d corner = (local.array() < 0).select(-half_size, half_size);
        return rotation * corner + position;
      };
}

}  // namespace

SensorBox sensor_box(const mjModel* model, const mjData* data, int site) {
  SensorBox box;
  const mjtNum* m = data->site_xmat + 9 * site;
  Eigen::Matrix3d rotation;
  rotation << m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8];
  box.world_from_box.rotation = Eigen::Quaterniond(rotation);
  box.world_from_box.position = Eigen::Map<const Vector3d>(data->site_xpos + 3 * site);
  box.half_size = Eigen::Map<const Vector3d>(model->site_size + 3 * site);
  return box;
}

bool overlaps(const mjModel* model, const mjData* data, int geom, const SensorBox& box) {
  if (!has_volume(model, geom)) return false;
  const Vector3d position = Eigen::Map<const Vector3d>(data->geom_xpos + 3 * geom);
  const double reach = model->geom_rbound[geom] + box.half_size.norm();
  if ((position - box.world_from_box.position).norm() > reach) return false;
  return intersect(points_of(model, data, geom), points_of(box));
}

bool body_overlaps(const mjModel* model, const mjData* data, int body, const SensorBox& box) {
  for (int i = 0; i < model->body_geomnum[body]; ++i) {
    if (overlaps(model, data, model->body_geomadr[body] + i, box)) return true;
  }
  return false;
}

double body_gap(const mjModel* model, const mjData* data, int body, const SensorBox& box) {
  double least = std::numeric_limits<double>::infinity();
  const Support box_points = points_of(box);
  for (int i = 0; i < model->body_geomnum[body]; ++i) {
    const int geom = model->body_geomadr[body] + i;
    if (has_volume(model, geom))
      least = std::min(least, convex_gap(points_of(model, data, geom), box_points));
  }
  return least;
}

}  // namespace flowscope
