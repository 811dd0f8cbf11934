#include "recorder/linkage_pose.h"

#include <mujoco/mujoco.h>

#include <Eigen/Dense>
#include <algorithm>

namespace flowscope {
namespace {

constexpr int kSteps = 30;
constexpr double kClosed = 1e-6;   ///< m or rad
constexpr double kDamping = 1e-6;  ///< of least squares
constexpr double kLargest = 0.2;   ///< change of a joint in one step, m or rad

/// Joints that may move.
std::vector<int> loose_joints(const mjModel* model, int ancestor, const std::vector<bool>& fixed) {
  std::vector<int> joints;
  for (int joint = 0; joint < model->njnt; ++joint) {
    const int type = model->jnt_type[joint];
    if (fixed[static_cast<std::size_t>(joint)] || (type != mjJNT_HINGE && type != mjJNT_SLIDE)) continue;
    int body = model->jnt_bodyid[joint];
    while (body != 0 && body != ancestor) body = model->body_parentid[body];
    if (body != 0) joints.push_back(joint);
  }
  return joints;
}

/// One column of the constraints' Jacobian for each joint; rows of equalities come first.
Eigen::MatrixXd jacobian(const mjModel* model, const mjData* data, const std::vector<int>& joints) {
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(data->ne, static_cast<Eigen::Index>(joints.size()));
  const bool sparse = mj_isSparse(model) != 0;
  for (int row = 0; row < data->ne; ++row) {
    for (std::size_t k = 0; k < joints.size(); ++k) {
      const int dof = model->jnt_dofadr[joints[k]];
      const auto column = static_cast<Eigen::Index>(k);
      if (!sparse) {
        result(row, column) = data->efc_J[row * model->nv + dof];
        continue;
      }
      const int* columns = data->efc_J_colind + data->efc_J_rowadr[row];
      const auto* found = std::find(columns, columns + data->efc_J_rownnz[row], dof);
      if (found != columns + data->efc_J_rownnz[row])
        result(row, column) = data->efc_J[data->efc_J_rowadr[row] + (found - columns)];
    }
  }
  return result;
}

}  // namespace

void close_linkages(const mjModel* model, mjData* data, int body, const std::vector<bool>& fixed) {
  const std::vector<int> joints = loose_joints(model, body, fixed);
  for (int step = 0;; ++step) {
    mj_kinematics(model, data);
    if (joints.empty() || model->neq == 0 || step == kSteps) return;
    mj_comPos(model, data);
    mj_tendon(model, data);
    data->ncon = 0;
    mj_makeConstraint(model, data);
    const Eigen::VectorXd gap = Eigen::Map<const Eigen::VectorXd>(data->efc_pos, data->ne);
    const Eigen::MatrixXd slope = jacobian(model, data, joints);
    // Gaps that these joints can close; a weld elsewhere is not their business.
    Eigen::VectorXd own = gap;
    for (Eigen::Index row = 0; row < own.size(); ++row) {
      if (slope.row(row).isZero()) own[row] = 0;
    }
    if (own.size() == 0 || own.cwiseAbs().maxCoeff() < kClosed) return;
    const Eigen::Index n = slope.cols();
    const Eigen::MatrixXd normal = slope.transpose() * slope + kDamping * Eigen::MatrixXd::Identity(n, n);
    const Eigen::VectorXd change = -normal.ldlt().solve(slope.transpose() * own);
    for (std::size_t k = 0; k < joints.size(); ++k) {
      double& q = data->qpos[model->jnt_qposadr[joints[k]]];
      q += std::clamp(change[static_cast<Eigen::Index>(k)], -kLargest, kLargest);
      const mjtNum* range = model->jnt_range + 2 * joints[k];
      if (model->jnt_limited[joints[k]]) q = std::clamp(q, range[0], range[1]);
    }
  }
}

}  // namespace flowscope
