#include "recorder/world_robot.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <stdexcept>

#include "recorder/success_overlap.h"

namespace flowscope {
namespace {

constexpr double kFingerTravel = 0.04;  ///< metres, each finger
constexpr double kSqueeze = 0.0005;     ///< metres: how far each finger presses into what it holds

int find(const mjModel* model, mjtObj type, const std::string& name) {
  const int id = mj_name2id(model, type, name.c_str());
  if (id < 0) throw std::runtime_error("the scene's robot lacks '" + name + "'");
  return id;
}

}  // namespace

WorldRobot::WorldRobot(const mjModel* model) {
  for (std::size_t i = 0; i < 7; ++i) {
    const std::string number = std::to_string(i + 1);
    const int joint = find(model, mjOBJ_JOINT, "joint" + number);
    qpos_[i] = model->jnt_qposadr[joint];
    dof_[i] = model->jnt_dofadr[joint];
    damping_[i] = model->dof_damping[dof_[i]];
    actuator_[i] = find(model, mjOBJ_ACTUATOR, "actuator" + number);
  }
  for (std::size_t i = 0; i < 2; ++i) {
    const std::string number = std::to_string(i + 1);
    const int joint = find(model, mjOBJ_JOINT, "finger_joint" + number);
    finger_qpos_[i] = model->jnt_qposadr[joint];
    finger_dof_[i] = model->jnt_dofadr[joint];
    finger_actuator_[i] = find(model, mjOBJ_ACTUATOR, "finger_actuator" + number);
  }
  tool_site_ = find(model, mjOBJ_SITE, "tool");
  attach_site_ = find(model, mjOBJ_SITE, "attach");
  hand_ = find(model, mjOBJ_BODY, "hand");
  for (int i = 0; i < model->neq; ++i) {
    if (model->eq_type[i] == mjEQ_WELD && model->eq_obj1id[i] == hand_)
      grasps_.push_back({i, model->eq_obj2id[i]});
  }
}

void WorldRobot::go_home(mjData* data) const {
  for (std::size_t i = 0; i < 7; ++i) data->qpos[qpos_[i]] = data->ctrl[actuator_[i]] = home_joints[i];
  for (std::size_t i = 0; i < 2; ++i)
    data->qpos[finger_qpos_[i]] = data->ctrl[finger_actuator_[i]] = kFingerTravel;
}

std::array<double, 7> WorldRobot::joint_targets(const mjData* data) const {
  std::array<double, 7> targets{};
  for (std::size_t i = 0; i < 7; ++i) targets[i] = data->ctrl[actuator_[i]];
  return targets;
}

void WorldRobot::drive(mjData* data, const std::array<double, 7>& target,
                       const std::array<double, 7>& target_speed, double openness, bool holding) const {
  for (std::size_t i = 0; i < 7; ++i) {
    data->ctrl[actuator_[i]] = target[i];
    // Gravity and Coriolis forces cancelled, and damping only against what the target does not ask for: the
    // arm then follows a moving target without lag.
    data->qfrc_applied[dof_[i]] = data->qfrc_bias[dof_[i]] + damping_[i] * target_speed[i];
  }
  for (std::size_t i = 0; i < 2; ++i) {
    double& finger = data->ctrl[finger_actuator_[i]];
    // What is held is welded; closing further would only press it out of its place.
    finger = holding ? std::max(openness * kFingerTravel, finger) : openness * kFingerTravel;
    data->qfrc_applied[finger_dof_[i]] = data->qfrc_bias[finger_dof_[i]];
  }
}

std::array<double, 7> WorldRobot::positions(const mjData* data) const {
  std::array<double, 7> q{};
  for (std::size_t i = 0; i < 7; ++i) q[i] = data->qpos[qpos_[i]];
  return q;
}

std::array<double, 7> WorldRobot::speeds(const mjData* data) const {
  std::array<double, 7> dq{};
  for (std::size_t i = 0; i < 7; ++i) dq[i] = data->qvel[dof_[i]];
  return dq;
}

double WorldRobot::openness(const mjData* data) const {
  const double width = data->qpos[finger_qpos_[0]] + data->qpos[finger_qpos_[1]];
  return std::clamp(width / (2 * kFingerTravel), 0.0, 1.0);
}

Pose WorldRobot::world_from_tool(const mjData* data) const {
  Eigen::Vector4d wxyz;
  mju_mat2Quat(wxyz.data(), data->site_xmat + 9 * tool_site_);
  return Pose::from_wxyz(Eigen::Map<const Eigen::Vector3d>(data->site_xpos + 3 * tool_site_), wxyz);
}

bool WorldRobot::grasp(mjModel* model, mjData* data) const {
  const SensorBox box = sensor_box(model, data, attach_site_);
  bool taken = false;
  for (const auto& [equality, body] : grasps_) {
    if (model->eq_active[equality] || !body_overlaps(model, data, body, box)) continue;
    // A weld's data: the anchor in the second body, then the second body's pose in the first, then a torque
    // scale.
    mjtNum* values = model->eq_data + mjNEQDATA * equality;
    mjtNum hand_inverse_position[3], hand_inverse_quaternion[4];
    mju_negPose(hand_inverse_position, hand_inverse_quaternion, data->xpos + 3 * hand_,
                data->xquat + 4 * hand_);
    mju_zero3(values);
    mju_mulPose(values + 3, values + 6, hand_inverse_position, hand_inverse_quaternion, data->xpos + 3 * body,
                data->xquat + 4 * body);
    values[10] = 1;
    model->eq_active[equality] = 1;
    taken = true;
  }
  if (taken) {
    for (std::size_t i = 0; i < 2; ++i) {
      data->ctrl[finger_actuator_[i]] = std::max(0.0, data->qpos[finger_qpos_[i]] - kSqueeze);
    }
  }
  return taken;
}

void WorldRobot::release(mjModel* model) const {
  for (const auto& grasp : grasps_) model->eq_active[grasp.equality] = 0;
}

std::vector<std::string> WorldRobot::grasped(const mjModel* model) const {
  std::vector<std::string> names;
  for (const auto& grasp : grasps_) {
    if (model->eq_active[grasp.equality]) names.emplace_back(mj_id2name(model, mjOBJ_BODY, grasp.body));
  }
  return names;
}

}  // namespace flowscope
