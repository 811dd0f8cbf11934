#include "recorder/motion/geom_bounds.h"

#include <mujoco/mujoco.h>

#include <limits>

namespace flowscope {
namespace {

using Eigen::Vector3d;
constexpr double kEndless = std::numeric_limits<double>::infinity();

struct LocalBox {
  Vector3d center{0, 0, 0}, half;
};

LocalBox mesh_box(const mjModel* model, int geom) {
  const int mesh = model->geom_dataid[geom], first = model->mesh_vertadr[mesh];
  Vector3d low = Vector3d::Constant(kEndless), high = -low;
  for (int i = first; i < first + model->mesh_vertnum[mesh]; ++i) {
    const Vector3d vertex = Eigen::Map<const Eigen::Vector3f>(model->mesh_vert + 3 * i).cast<double>();
    low = low.cwiseMin(vertex);
    high = high.cwiseMax(vertex);
  }
  return {(low + high) / 2, (high - low) / 2};
}

LocalBox local_box(const mjModel* model, int geom) {
  const mjtNum* size = model->geom_size + 3 * geom;
  switch (model->geom_type[geom]) {
    case mjGEOM_SPHERE:
      return {{0, 0, 0}, Vector3d::Constant(size[0])};
    case mjGEOM_CAPSULE:
      return {{0, 0, 0}, {size[0], size[0], size[0] + size[1]}};
    case mjGEOM_CYLINDER:
      return {{0, 0, 0}, {size[0], size[0], size[1]}};
    case mjGEOM_ELLIPSOID:
    case mjGEOM_BOX:
      return {{0, 0, 0}, {size[0], size[1], size[2]}};
    case mjGEOM_MESH:
      return mesh_box(model, geom);
    case mjGEOM_PLANE:  // everything below it
      return {{0, 0, -1e6}, {1e6, 1e6, 1e6}};
    default:
      return {{0, 0, 0}, Vector3d::Constant(model->geom_rbound[geom])};
  }
}

}  // namespace

GeomBounds geom_bounds(const mjModel* model, const mjData* data, int geom) {
  const LocalBox box = local_box(model, geom);
  GeomBounds bounds;
  bounds.world_from_box =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(data->geom_xmat + 9 * geom);
  bounds.center = Eigen::Map<const Vector3d>(data->geom_xpos + 3 * geom) + bounds.world_from_box * box.center;
  bounds.half = box.half;
  const Vector3d reach = bounds.world_from_box.cwiseAbs() * box.half;
  bounds.low = bounds.center - reach;
  bounds.high = bounds.center + reach;
  return bounds;
}

}  // namespace flowscope
