#include "recorder/motion/kinematics.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <stdexcept>

#include "recorder/motion/numeric_arm.h"
#include "recorder/motion/panda_arm.h"
#include "recorder/motion/posture.h"
#include "render/mujoco_owners.h"

namespace flowscope {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Pose site_pose(const mjData* data, int site) {
  const double* p = data->site_xpos + 3 * site;
  const Matrix3d rotation =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(data->site_xmat + 9 * site);
  return {{p[0], p[1], p[2]}, Eigen::Quaterniond(rotation).normalized()};
}

void set_joints(mjData* data, const ArmIndices& arm, const JointVector& q) {
  for (std::size_t i = 0; i < arm.joints; ++i) data->qpos[arm.qpos[i]] = q[i];
}

}  // namespace

bool JointLimits::contain(const JointVector& q) const {
  for (std::size_t i = 0; i < joints; ++i) {
    if (!(q[i] >= lower[i] && q[i] <= upper[i])) return false;
  }
  return true;
}

double joint_distance(const JointVector& a, const JointVector& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, std::abs(a[i] - b[i]));
  return largest;
}

ArmIndices find_arm(const mjModel* model, const RobotDescription& robot) {
  if (robot.joints.empty()) throw std::runtime_error("the scene has no robot");
  const auto find = [&](mjtObj type, const std::string& name) {
    const int id = mj_name2id(model, type, name.c_str());
    if (id < 0) throw std::runtime_error("the scene's robot lacks '" + name + "'");
    return id;
  };
  ArmIndices arm;
  arm.tool_site = find(mjOBJ_SITE, robot.tool);
  arm.hand = find(mjOBJ_BODY, robot.hand);
  for (const auto& name : robot.joints) {
    const int joint = find(mjOBJ_JOINT, name);
    if (model->jnt_type[joint] != mjJNT_HINGE) throw std::runtime_error("joint '" + name + "' is no hinge");
    arm.joint[arm.joints] = joint;
    arm.qpos[arm.joints] = model->jnt_qposadr[joint];
    arm.dof[arm.joints++] = model->jnt_dofadr[joint];
  }
  for (int body = model->site_bodyid[arm.tool_site]; body != 0; body = model->body_parentid[body]) {
    for (int k = 0; k < model->body_jntnum[body]; ++k) {
      const int joint = model->body_jntadr[body] + k;
      const auto end = arm.joint.begin() + static_cast<std::ptrdiff_t>(arm.joints);
      if (std::find(arm.joint.begin(), end, joint) != end) continue;
      const char* name = mj_id2name(model, mjOBJ_JOINT, joint);
      throw std::runtime_error(std::string("joint '") + (name ? name : "") +
                               "' moves the tool, but the robot's description does not list it");
    }
  }
  return arm;
}

namespace {

/// Where the joints may go and the actuators' inputs let them.
JointLimits limits_of(const mjModel* model, const ArmIndices& arm, const RobotDescription& robot) {
  JointLimits limits;
  limits.joints = arm.joints;
  const bool clamped = !(model->opt.disableflags & mjDSBL_CLAMPCTRL);
  for (std::size_t i = 0; i < arm.joints; ++i) {
    const mjtNum* range = model->jnt_range + 2 * arm.joint[i];
    const bool limited = model->jnt_limited[arm.joint[i]];
    limits.lower[i] = limited ? range[0] : -std::numbers::pi;
    limits.upper[i] = limited ? range[1] : std::numbers::pi;
    const int actuator =
        i < robot.actuators.size() ? mj_name2id(model, mjOBJ_ACTUATOR, robot.actuators[i].c_str()) : -1;
    if (actuator < 0 || !clamped || !model->actuator_ctrllimited[actuator]) continue;
    limits.lower[i] = std::max(limits.lower[i], model->actuator_ctrlrange[2 * actuator]);
    limits.upper[i] = std::min(limits.upper[i], model->actuator_ctrlrange[2 * actuator + 1]);
  }
  return limits;
}

/// `data` at zero posture. At zero the axes of the first two joints are the base's z and y, and the first
/// one's anchor lies on the base's z.
Kinematics panda_of(const mjData* data, const ArmIndices& arm, const JointLimits& limits) {
  const Vector3d z = Eigen::Map<const Vector3d>(data->xaxis + 3 * arm.joint[0]).normalized();
  const Vector3d y = Eigen::Map<const Vector3d>(data->xaxis + 3 * arm.joint[1]).normalized();
  Matrix3d axes;
  axes << y.cross(z), y, z;
  Pose world_from_base;
  world_from_base.rotation = Eigen::Quaterniond(axes).normalized();
  world_from_base.position =
      Eigen::Map<const Vector3d>(data->xanchor + 3 * arm.joint[1]) - panda_shoulder_m * z;
  const Pose flange_from_tool =
      (world_from_base * panda_base_from_flange({})).inverse() * site_pose(data, arm.tool_site);
  return {world_from_base, flange_from_tool, limits};
}

/// `data` at zero posture.
Kinematics numeric_of(const mjData* data, const ArmIndices& arm, const JointLimits& limits,
                      const JointVector& home) {
  std::vector<NumericArm::Hinge> hinges;
  for (std::size_t i = 0; i < arm.joints; ++i) {
    hinges.push_back({Eigen::Map<const Vector3d>(data->xaxis + 3 * arm.joint[i]).normalized(),
                      Eigen::Map<const Vector3d>(data->xanchor + 3 * arm.joint[i])});
  }
  return Kinematics(NumericArm(std::move(hinges), site_pose(data, arm.tool_site), limits, home));
}

}  // namespace

Kinematics::Kinematics(const Pose& world_from_base, const Pose& flange_from_tool, const JointLimits& limits)
    : world_from_base_(world_from_base), flange_from_tool_(flange_from_tool), limits_(limits) {}

Kinematics::Kinematics(NumericArm arm)
    : limits_(arm.limits()), numeric_(std::make_shared<const NumericArm>(std::move(arm))) {}

Kinematics Kinematics::from_model(const mjModel* model, const RobotDescription& robot) {
  const ArmIndices arm = find_arm(model, robot);
  const DataPtr data(mj_makeData(model));
  const JointLimits limits = limits_of(model, arm, robot);
  set_joints(data.get(), arm, {});
  mj_kinematics(model, data.get());
  const bool panda = robot.inverse_kinematics == InverseKinematics::panda;
  const Kinematics result =
      panda ? panda_of(data.get(), arm, limits) : numeric_of(data.get(), arm, limits, robot.home);

  for (int posture = 0; posture <= 8; ++posture) {
    JointVector q{};
    for (std::size_t i = 0; i < arm.joints; ++i) {
      const double share = 0.5 + 0.45 * std::sin(1.7 * posture + 2.3 * static_cast<double>(i));
      q[i] = limits.lower[i] + share * (limits.upper[i] - limits.lower[i]);
    }
    set_joints(data.get(), arm, q);
    mj_kinematics(model, data.get());
    const Pose expected = site_pose(data.get(), arm.tool_site), found = result.world_from_tool(q);
    if (position_error_m(expected, found) > 1e-9 ||
        (expected.rotation.toRotationMatrix() - found.rotation.toRotationMatrix()).norm() > 1e-9) {
      throw std::runtime_error(panda ? "the arm in the scene has not the dimensions of a Panda"
                                     : "the tool of robot '" + robot.name +
                                           "' does not hang on its joints alone, in their order");
    }
  }
  return result;
}

Pose Kinematics::world_from_tool(const JointVector& q) const {
  if (numeric_) return numeric_->world_from_tool(q);
  return world_from_base_ * panda_base_from_flange(q) * flange_from_tool_;
}

Pose Kinematics::base_from_flange(const Pose& world_from_tool) const {
  return world_from_base_.inverse() * world_from_tool * flange_from_tool_.inverse();
}

double Kinematics::manipulability(const JointVector& q) const {
  return numeric_ ? numeric_->manipulability(q) : panda_manipulability(q, flange_from_tool_);
}

std::vector<JointVector> Kinematics::solve(const Pose& world_from_tool, double q7) const {
  if (numeric_) return {};
  const PandaSolutions found = solve_panda(base_from_flange(world_from_tool), q7, limits_);
  return {found.q.begin(), found.q.begin() + found.count};
}

/// Postures and what each is worth, while they are collected.
class Kinematics::Choice {
 public:
  Choice(const Kinematics& arm, const Pose& world_from_tool, const JointVector& near)
      : arm_(arm), base_from_flange_(arm.base_from_flange(world_from_tool)), near_(near) {}

  bool in_reach() const { return panda_in_reach(base_from_flange_); }
  void see(double q7) {
    const PandaSolutions found = solve_panda(base_from_flange_, q7, arm_.limits());
    for (int i = 0; i < found.count; ++i) {
      const JointVector& q = found.q[static_cast<std::size_t>(i)];
      ranked_.push_back({posture_cost(q, near_, arm_.limits(), arm_.manipulability(q)), q});
    }
  }
  void sweep(int samples) {
    const double lower = arm_.limits().lower[6], upper = arm_.limits().upper[6];
    for (int i = 0; i < samples; ++i) {
      see(std::lerp(lower, upper, samples > 1 ? double(i) / (samples - 1) : 0.5));
    }
  }
  /// Looks around the best posture in ever smaller steps, the first being `step` rad of q7.
  void refine(double step) {
    const auto best = [this] { return *std::ranges::min_element(ranked_, {}, &Ranked::cost); };
    for (int round = 0; round < kRefinements; ++round, step /= 2) {
      const double q7 = best().q[6];
      for (const double other : {q7 - step, q7 + step}) {
        if (other >= arm_.limits().lower[6] && other <= arm_.limits().upper[6]) see(other);
      }
    }
  }
  bool empty() const { return ranked_.empty(); }
  std::vector<JointVector> in_order() {
    std::ranges::stable_sort(ranked_, {}, &Ranked::cost);
    std::vector<JointVector> postures;
    postures.reserve(ranked_.size());
    for (const Ranked& r : ranked_) postures.push_back(r.q);
    return postures;
  }

 private:
  struct Ranked {
    double cost;
    JointVector q;
  };
  static constexpr int kRefinements = 4;
  const Kinematics& arm_;
  const Pose base_from_flange_;
  const JointVector& near_;
  std::vector<Ranked> ranked_;
};

std::vector<JointVector> Kinematics::solve_all(const Pose& world_from_tool, const JointVector& near,
                                               int samples) const {
  if (numeric_) {
    auto found = numeric_->solve_all(world_from_tool, near);
    std::ranges::stable_sort(
        found, {}, [&](const JointVector& q) { return posture_cost(q, near, limits_, manipulability(q)); });
    return found;
  }
  constexpr int finest = 64;  // how many times the samples where there seems to be nothing
  Choice choice(*this, world_from_tool, near);
  if (!choice.in_reach()) return {};
  choice.see(std::clamp(near[6], limits_.lower[6], limits_.upper[6]));
  int times = 1;
  choice.sweep(samples);
  while (choice.empty() && times < finest) choice.sweep(samples * (times *= 8));
  if (choice.empty()) return {};
  choice.refine((limits_.upper[6] - limits_.lower[6]) / (2.0 * samples * times));
  return choice.in_order();
}

std::optional<JointVector> Kinematics::follow(const Pose& world_from_tool, const JointVector& near,
                                              const JointVector& posture) const {
  if (numeric_) return numeric_->solve_from(world_from_tool, near, posture);
  const auto candidates = solve(world_from_tool, posture[6]);
  const auto nearest = std::min_element(
      candidates.begin(), candidates.end(),
      [&](const auto& a, const auto& b) { return joint_distance(a, near) < joint_distance(b, near); });
  if (nearest == candidates.end()) return std::nullopt;
  return *nearest;
}

}  // namespace flowscope
