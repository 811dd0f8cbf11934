#include "recorder/world_robot.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "recorder/linkage_pose.h"
#include "recorder/robot_servo.h"
#include "recorder/success_overlap.h"

namespace flowscope {
namespace {

constexpr double kSlow_s = 0.04;  ///< a servo's time constant: a gripper's move takes 0.1 s
constexpr double kAhead = 0.2;    ///< of its way: the whole way would crush what is held

int find(const mjModel* model, mjtObj type, const std::string& name) {
  const int id = mj_name2id(model, type, name.c_str());
  if (id < 0) throw std::runtime_error("the scene's robot lacks '" + name + "'");
  return id;
}

bool is_below(const mjModel* model, int body, int ancestor) {
  while (body != 0 && body != ancestor) body = model->body_parentid[body];
  return body == ancestor;
}

}  // namespace

WorldRobot::WorldRobot(const mjModel* model, const RobotDescription& robot)
    : model_(model), squeeze_(robot.squeeze) {
  if (robot.joints.empty()) return;
  ties_.emplace(model);
  driven_.resize(static_cast<std::size_t>(model->njnt));
  for (std::size_t i = 0; i < robot.joints.size(); ++i) {
    const int joint = find(model, mjOBJ_JOINT, robot.joints[i]), dof = model->jnt_dofadr[joint];
    joints_.push_back({model->jnt_qposadr[joint], dof, find(model, mjOBJ_ACTUATOR, robot.actuators[i]),
                       model->dof_damping[dof], robot.home[i]});
    Joint& added = joints_.back();
    const PositionServo servo = position_servo(model, added.actuator);
    const bool limited = model->actuator_forcelimited[added.actuator];
    const mjtNum* force = model->actuator_forcerange + 2 * added.actuator;
    added.servo_stiffness = servo.stiffness;
    added.servo_damping = servo.damping;
    added.lowest_force = limited ? force[0] : -std::numeric_limits<double>::infinity();
    added.highest_force = limited ? force[1] : std::numeric_limits<double>::infinity();
    driven_[static_cast<std::size_t>(joint)] = true;
  }
  for (const auto& finger : robot.fingers) {
    const int joint = find(model, mjOBJ_JOINT, finger.joint);
    const int actuator = finger.actuator.empty() ? -1 : find(model, mjOBJ_ACTUATOR, finger.actuator);
    fingers_.push_back({model->jnt_qposadr[joint], model->jnt_dofadr[joint], actuator, finger.open,
                        finger.closed, finger.command_open.has_value(),
                        finger.command_open.value_or(finger.open),
                        finger.command_closed.value_or(finger.closed)});
    driven_[static_cast<std::size_t>(joint)] = true;
    if (actuator < 0) continue;
    const PositionServo servo = position_servo(model, actuator);
    fingers_.back().slow = servo.damping > kSlow_s * servo.stiffness;
  }
  tool_site_ = find(model, mjOBJ_SITE, robot.tool);
  attach_site_ = find(model, mjOBJ_SITE, robot.attach);
  hand_ = find(model, mjOBJ_BODY, robot.hand);
  of_fingers_.resize(static_cast<std::size_t>(model->nbody));
  for (int body = 1; body < model->nbody; ++body) {
    of_fingers_[static_cast<std::size_t>(body)] =
        is_below(model, body, hand_) && model->body_weldid[body] != model->body_weldid[hand_];
  }
  for (int i = 0; i < model->neq; ++i) {
    if (model->eq_type[i] == mjEQ_WELD && model->eq_obj1id[i] == hand_)
      grasps_.push_back({i, model->eq_obj2id[i]});
  }
}

void WorldRobot::go_home(mjData* data) const {
  for (const auto& joint : joints_) data->qpos[joint.qpos] = data->ctrl[joint.actuator] = joint.home;
  for (const auto& finger : fingers_) {
    data->qpos[finger.qpos] = finger.open;
    if (finger.actuator >= 0) data->ctrl[finger.actuator] = finger.input_open;
  }
  if (!ties_) return;
  std::vector<bool> known = driven_;
  ties_->spread(known, data->qpos);
  close_linkages(model_, data, hand_, known);
}

std::array<double, 7> WorldRobot::joint_targets(const mjData* data) const {
  std::array<double, 7> targets{};
  for (std::size_t i = 0; i < joints_.size(); ++i) targets[i] = data->ctrl[joints_[i].actuator];
  return targets;
}

double WorldRobot::openness_target(const mjData* data) const {
  double openness = 1;
  for (const auto& finger : fingers_) {
    if (finger.actuator < 0) continue;
    const double input = data->ctrl[finger.actuator];
    openness =
        std::clamp((input - finger.input_closed) / (finger.input_open - finger.input_closed), 0.0, 1.0);
  }
  return openness;
}

void WorldRobot::drive(mjData* data, const std::array<double, 7>& target,
                       const std::array<double, 7>& target_speed, double openness, bool holding) const {
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const Joint& joint = joints_[i];
    data->ctrl[joint.actuator] = target[i];
    // Gravity and Coriolis forces cancelled, and damping only against what the target does not ask for: the
    // arm then follows a moving target without lag.
    data->qfrc_applied[joint.dof] = data->qfrc_bias[joint.dof] + joint.damping * target_speed[i];
    if (joint.servo_damping == 0) continue;
    // The servo's own damping, likewise, as far as its force goes.
    const double q = data->qpos[joint.qpos], speed = data->qvel[joint.dof];
    data->qfrc_applied[joint.dof] +=
        joint.servo_force(target[i], q, speed - target_speed[i]) - joint.servo_force(target[i], q, speed);
  }
  for (const auto& finger : fingers_) {
    data->qfrc_applied[finger.dof] = data->qfrc_bias[finger.dof];
    if (finger.actuator < 0) continue;
    double& input = data->ctrl[finger.actuator];
    // What is held is welded; closing further would only press it out of its place. A slow finger has still
    // to arrive there, whatever it was told: by now that is only where it was bound at the time.
    if (!holding) {
      input = finger.input(openness);
    } else if (finger.slow) {
      input = finger.holding_input(data->qpos[finger.qpos], touches(data), squeeze_);
    } else {
      input = finger.wider(finger.input(openness), input);
    }
  }
}

double WorldRobot::Joint::servo_force(double target, double q, double speed) const {
  return std::clamp(servo_stiffness * (target - q) - servo_damping * speed, lowest_force, highest_force);
}

double WorldRobot::Finger::holding_input(double q, bool touching, double squeeze) const {
  return pressing(q, touching ? squeeze : std::max(squeeze, kAhead * std::abs(open - closed)));
}

bool WorldRobot::touches(const mjData* data) const {
  const auto is_loose = [this](int body) {
    return std::any_of(grasps_.begin(), grasps_.end(),
                       [&](const Grasp& grasp) { return is_below(model_, body, grasp.body); });
  };
  for (int i = 0; i < data->ncon; ++i) {
    const int one = model_->geom_bodyid[data->contact[i].geom1],
              other = model_->geom_bodyid[data->contact[i].geom2];
    if ((of_fingers_[static_cast<std::size_t>(one)] && is_loose(other)) ||
        (of_fingers_[static_cast<std::size_t>(other)] && is_loose(one)))
      return true;
  }
  return false;
}

std::array<double, 7> WorldRobot::positions(const mjData* data) const {
  std::array<double, 7> q{};
  for (std::size_t i = 0; i < joints_.size(); ++i) q[i] = data->qpos[joints_[i].qpos];
  return q;
}

std::array<double, 7> WorldRobot::speeds(const mjData* data) const {
  std::array<double, 7> dq{};
  for (std::size_t i = 0; i < joints_.size(); ++i) dq[i] = data->qvel[joints_[i].dof];
  return dq;
}

double WorldRobot::openness(const mjData* data) const {
  double opened = 0, travel = 0;
  for (const auto& finger : fingers_) {
    if (finger.actuator < 0) continue;
    const double sign = finger.open > finger.closed ? 1 : -1;
    opened += sign * (data->qpos[finger.qpos] - finger.closed);
    travel += sign * (finger.open - finger.closed);
  }
  return travel > 0 ? std::clamp(opened / travel, 0.0, 1.0) : 1;
}

Pose WorldRobot::world_from_tool(const mjData* data) const {
  if (tool_site_ < 0) return {};
  Eigen::Vector4d wxyz;
  mju_mat2Quat(wxyz.data(), data->site_xmat + 9 * tool_site_);
  return Pose::from_wxyz(Eigen::Map<const Eigen::Vector3d>(data->site_xpos + 3 * tool_site_), wxyz);
}

bool WorldRobot::grasp(mjModel* model, mjData* data) const {
  if (grasps_.empty()) return false;
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
    for (const auto& finger : fingers_) {
      if (finger.actuator < 0) continue;
      const double q = data->qpos[finger.qpos];
      // A slow one has still to arrive at what it closes on (see drive).
      data->ctrl[finger.actuator] =
          finger.slow ? finger.holding_input(q, touches(data), squeeze_) : finger.pressing(q, squeeze_);
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
