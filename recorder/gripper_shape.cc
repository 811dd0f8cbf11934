#include "recorder/gripper_shape.h"

#include <mujoco/mujoco.h>

#include <algorithm>

#include "recorder/linkage_pose.h"
#include "recorder/robot_ties.h"
#include "render/mujoco_owners.h"

namespace flowscope {
namespace {

constexpr int kSteps = 8;             ///< of openness: fingers on cranks move along arcs
constexpr std::size_t kPieces = 100;  ///< many ghosts may be drawn at once

bool can_be_drawn(const mjModel* model, int geom) {
  const int type = model->geom_type[geom];
  return model->geom_group[geom] <= 2 && type >= mjGEOM_SPHERE && type <= mjGEOM_MESH;
}

std::vector<int> pieces_of(const mjModel* model, int hand) {
  std::vector<char> below(static_cast<std::size_t>(model->nbody));
  for (int body = 1; body < model->nbody; ++body) {  // parents come before their children
    below[body] = body == hand || below[model->body_parentid[body]];
  }
  std::vector<int> geoms;
  for (int geom = 0; geom < model->ngeom; ++geom) {
    if (below[model->geom_bodyid[geom]] && can_be_drawn(model, geom)) geoms.push_back(geom);
  }
  std::ranges::stable_sort(geoms,
                           [&](int a, int b) { return model->geom_rbound[a] > model->geom_rbound[b]; });
  if (geoms.size() > kPieces) geoms.resize(kPieces);
  return geoms;
}

Pose pose(const mjtNum* position, const mjtNum* rotation) {
  const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> matrix(rotation);
  return {Eigen::Map<const Eigen::Vector3d>(position), Eigen::Quaterniond(Eigen::Matrix3d(matrix))};
}

}  // namespace

std::shared_ptr<const GripperShape> gripper_shape(const mjModel* model, const RobotDescription& robot) {
  const int hand = mj_name2id(model, mjOBJ_BODY, robot.hand.c_str());
  const int tool = mj_name2id(model, mjOBJ_SITE, robot.tool.c_str());
  if (hand < 0 || tool < 0) return nullptr;
  std::vector<int> fingers;
  std::vector<bool> named(static_cast<std::size_t>(model->njnt));
  for (const FingerDescription& finger : robot.fingers) {
    const int joint = mj_name2id(model, mjOBJ_JOINT, finger.joint.c_str());
    if (joint < 0) return nullptr;
    fingers.push_back(model->jnt_qposadr[joint]);
    named[static_cast<std::size_t>(joint)] = true;
  }
  const std::vector<int> geoms = pieces_of(model, hand);
  if (geoms.empty()) return nullptr;

  auto shape = std::make_shared<GripperShape>();
  for (const int geom : geoms) {
    const bool mesh = model->geom_type[geom] == mjGEOM_MESH;
    shape->parts.push_back({model->geom_type[geom],
                            mesh ? model->geom_dataid[geom] : -1,
                            Eigen::Map<const Eigen::Vector3d>(model->geom_size + 3 * geom),
                            {}});
  }
  const DataPtr data(mj_makeData(model));
  const JointTies ties(model);
  for (int step = 0; step <= kSteps; ++step) {
    for (std::size_t i = 0; i < fingers.size(); ++i) {
      const FingerDescription& finger = robot.fingers[i];
      data->qpos[fingers[i]] = finger.closed + (finger.open - finger.closed) * step / kSteps;
    }
    std::vector<bool> known = named;
    ties.spread(known, data->qpos);
    close_linkages(model, data.get(), hand, known);
    const Pose tool_from_world = pose(data->site_xpos + 3 * tool, data->site_xmat + 9 * tool).inverse();
    for (std::size_t i = 0; i < geoms.size(); ++i) {
      const Pose world_from_geom = pose(data->geom_xpos + 3 * geoms[i], data->geom_xmat + 9 * geoms[i]);
      shape->parts[i].tool_from_part.push_back(tool_from_world * world_from_geom);
    }
  }
  return shape;
}

}  // namespace flowscope
