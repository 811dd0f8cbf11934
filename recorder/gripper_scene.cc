#include "recorder/gripper_scene.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>

#include "recorder/linkage_pose.h"
#include "recorder/robot_names.h"
#include "recorder/script.h"

namespace flowscope {

GripperScene::GripperScene(const mjModel* the_model, const RobotDescription& the_robot,
                           const std::vector<int>& the_arm, int the_hand, bool is_to_come)
    : model(the_model),
      robot(the_robot),
      arm(the_arm),
      hand(the_hand),
      to_come(is_to_come),
      ties(the_model),
      data(mj_makeData(the_model)) {}

void GripperScene::fail(std::size_t finger, const char* key, const std::string& message) const {
  throw BadScript(robot.places.of("fingers[" + std::to_string(finger) + "]" + key) + message);
}

void GripperScene::pose(double openness) {
  std::copy(model->qpos0, model->qpos0 + model->nq, data->qpos);
  std::vector<bool> known(static_cast<std::size_t>(model->njnt));
  const auto set = [&](int joint, double value) {
    data->qpos[model->jnt_qposadr[joint]] = value;
    known[static_cast<std::size_t>(joint)] = true;
  };
  for (std::size_t i = 0; i < arm.size(); ++i) set(arm[i], robot.home[i]);
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const FingerDescription& finger = robot.fingers[i];
    set(joints[i], std::lerp(finger.closed, finger.open, openness));
  }
  ties.spread(known, data->qpos);
  close_linkages(model, data.get(), hand, known);
  mj_fwdPosition(model, data.get());
}

bool GripperScene::acts_on(int actuator, int joint) const {
  return std::abs(data->actuator_moment[actuator * model->nv + model->jnt_dofadr[joint]]) > 1e-9;
}

std::string GripperScene::driver_of(int joint) const {
  for (int other = 0; other < model->nu; ++other) {
    if (acts_on(other, joint)) return "; " + name_of(model, mjOBJ_ACTUATOR, other) + " does";
  }
  return "";
}

bool GripperScene::is_driven(int joint) const {
  return std::ranges::any_of(pulled, [joint](const auto& by) { return by[static_cast<std::size_t>(joint)]; });
}

double GripperScene::way(std::size_t finger) const {
  return std::abs(robot.fingers[finger].open - robot.fingers[finger].closed);
}

const char* GripperScene::unit(std::size_t finger) const {
  return model->jnt_type[joints[finger]] == mjJNT_SLIDE ? " m" : " rad";
}

std::string GripperScene::joint_name(int joint) const { return name_of(model, mjOBJ_JOINT, joint); }

bool GripperScene::is_below(int body, int ancestor) const {
  while (body != 0 && body != ancestor) body = model->body_parentid[body];
  return body == ancestor;
}

Pose GripperScene::world_from_tool() const {
  if (robot.tool_place && to_come) {
    const int body = mj_name2id(model, mjOBJ_BODY, robot.tool_place->body.c_str());
    return Pose::from_wxyz(Eigen::Map<const Eigen::Vector3d>(data->xpos + 3 * body),
                           Eigen::Map<const Eigen::Vector4d>(data->xquat + 4 * body)) *
           robot.tool_place->body_from_site;
  }
  const int site = mj_name2id(model, mjOBJ_SITE, robot.tool.c_str());
  Eigen::Vector4d wxyz;
  mju_mat2Quat(wxyz.data(), data->site_xmat + 9 * site);
  return Pose::from_wxyz(Eigen::Map<const Eigen::Vector3d>(data->site_xpos + 3 * site), wxyz);
}

}  // namespace flowscope
