#include "recorder/motion/moving_parts.h"

#include <mujoco/mujoco.h>

#include <Eigen/Geometry>
#include <algorithm>

namespace flowscope {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

bool is_below(const mjModel* model, int body, int ancestor) {
  while (body != 0 && body != ancestor) body = model->body_parentid[body];
  return body == ancestor;
}

Vector3d vector(const mjtNum* values) { return Eigen::Map<const Vector3d>(values); }
Matrix3d matrix(const mjtNum* row_major) { return Eigen::Map<const RowMajor>(row_major); }
Matrix3d matrix_of_wxyz(const mjtNum* q) {
  return Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
}

}  // namespace

bool goes_anywhere(const mjModel* model, int body) {
  if (model->body_dofnum[body] != 6) return false;
  const int first = model->body_jntadr[body];
  for (int joint = first; joint < first + model->body_jntnum[body]; ++joint) {
    if (model->jnt_limited[joint]) return false;
  }
  return true;
}

MovingParts::MovingParts(const mjModel* model, const mjData* data, const ArmIndices& arm,
                         const std::vector<std::string>& held)
    : moves_(static_cast<std::size_t>(model->nbody)),
      in_hand_(static_cast<std::size_t>(model->nbody)),
      carried_(static_cast<std::size_t>(model->nbody)),
      part_of_(static_cast<std::size_t>(model->nbody), -1) {
  const int first_link = model->jnt_bodyid[arm.joint[0]], hand = arm.hand;
  for (int body = 1; body < model->nbody; ++body) {
    in_hand_[body] = is_below(model, body, hand);
    if (is_below(model, body, first_link)) add_part(data, body, part_of_[model->body_parentid[body]]);
  }
  for (std::size_t i = 0; i < arm.joints; ++i) {
    const int joint = arm.joint[i], body = model->jnt_bodyid[joint];
    Part& part = parts_[static_cast<std::size_t>(part_of_[body])];
    part.joint = static_cast<int>(i);
    part.position = vector(model->body_pos + 3 * body);
    part.rotation = matrix_of_wxyz(model->body_quat + 4 * body);
    part.axis = vector(model->jnt_axis + 3 * joint);
    part.anchor = vector(model->jnt_pos + 3 * joint);
    part.zero = model->qpos0[arm.qpos[i]];
    if (part.parent < 0) {  // what the first link stands on does not move
      const int base = model->body_parentid[body];
      const Matrix3d world_from_base = matrix(data->xmat + 9 * base);
      part.position = vector(data->xpos + 3 * base) + world_from_base * part.position;
      part.rotation = world_from_base * part.rotation;
    }
  }
  for (const auto& name : held) {
    const int root = mj_name2id(model, mjOBJ_BODY, name.c_str());
    if (root < 0) continue;
    const bool goes_along = goes_anywhere(model, root);
    for (int body = 1; body < model->nbody; ++body) {
      if (!is_below(model, body, root)) continue;
      in_hand_[body] = true;
      carried_[body] = goes_along;
      if (goes_along) add_part(data, body, part_of_[body == root ? hand : model->body_parentid[body]]);
    }
  }
  for (int geom = 0; geom < model->ngeom; ++geom) {
    const int part = part_of_[model->geom_bodyid[geom]];
    if (part < 0) continue;
    geoms_.push_back(
        {geom, part, vector(model->geom_pos + 3 * geom), matrix_of_wxyz(model->geom_quat + 4 * geom)});
  }
}

void MovingParts::add_part(const mjData* data, int body, int parent) {
  Part part;
  part.parent = parent;
  part.position = vector(data->xpos + 3 * body);
  part.rotation = matrix(data->xmat + 9 * body);
  part.world_position = part.position;
  part.world_rotation = part.rotation;
  if (parent >= 0) {
    const Part& above = parts_[static_cast<std::size_t>(parent)];
    part.position = above.world_rotation.transpose() * (part.world_position - above.world_position);
    part.rotation = above.world_rotation.transpose() * part.world_rotation;
  }
  moves_[body] = true;
  part_of_[body] = static_cast<int>(parts_.size());
  parts_.push_back(part);
}

void MovingParts::place(const JointVector& q, mjData* data) {
  for (Part& part : parts_) {
    Vector3d position = part.position;
    Matrix3d rotation = part.rotation;
    if (part.joint >= 0) {
      const double angle = q[static_cast<std::size_t>(part.joint)] - part.zero;
      const Matrix3d turned = rotation * Eigen::AngleAxisd(angle, part.axis).toRotationMatrix();
      position += rotation * part.anchor - turned * part.anchor;
      rotation = turned;
    }
    if (part.parent >= 0) {
      const Part& above = parts_[static_cast<std::size_t>(part.parent)];
      position = above.world_position + above.world_rotation * position;
      rotation = above.world_rotation * rotation;
    }
    part.world_position = position;
    part.world_rotation = rotation;
  }
  for (const Geom& geom : geoms_) {
    const Part& part = parts_[static_cast<std::size_t>(geom.part)];
    Eigen::Map<Vector3d>(data->geom_xpos + 3 * geom.id) =
        part.world_position + part.world_rotation * geom.body_from_geom_position;
    Eigen::Map<RowMajor>(data->geom_xmat + 9 * geom.id) = part.world_rotation * geom.body_from_geom;
  }
}

}  // namespace flowscope
