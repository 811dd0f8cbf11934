#include "recorder/kinematics.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <stdexcept>

#include "recorder/numeric_arm.h"
#include "render/mujoco_owners.h"

namespace flowscope {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// The arm's published dimensions, metres: modified Denavit-Hartenberg parameters of the Panda.
constexpr double kBaseToShoulder = 0.333, kShoulderToElbow = 0.316, kElbowToWrist = 0.384;
constexpr double kElbowOffset = 0.0825, kWristOffset = 0.088, kWristToFlange = 0.107;

Matrix3d rot_x(double angle) { return Eigen::AngleAxisd(angle, Vector3d::UnitX()).toRotationMatrix(); }
Matrix3d rot_z(double angle) { return Eigen::AngleAxisd(angle, Vector3d::UnitZ()).toRotationMatrix(); }

Pose base_from_flange(const JointVector& q) {
  struct Link {
    double a, d, alpha;
  };
  constexpr double right = std::numbers::pi / 2;
  constexpr std::array<Link, 7> links{{{0, kBaseToShoulder, 0},
                                       {0, 0, -right},
                                       {0, kShoulderToElbow, right},
                                       {kElbowOffset, 0, right},
                                       {-kElbowOffset, kElbowToWrist, -right},
                                       {0, 0, right},
                                       {kWristOffset, 0, right}}};
  Matrix3d rotation = Matrix3d::Identity();
  Vector3d position = Vector3d::Zero();
  for (std::size_t i = 0; i < links.size(); ++i) {
    position += rotation * Vector3d(links[i].a, 0, 0);
    rotation = rotation * rot_x(links[i].alpha);
    position += rotation * Vector3d(0, 0, links[i].d);
    rotation = rotation * rot_z(q[i]);
  }
  position += rotation * Vector3d(0, 0, kWristToFlange);
  return {position, Eigen::Quaterniond(rotation).normalized()};
}

/// `angle` turned by whole turns into [lower, upper] if any such turn lies there.
double wrapped(double angle, double lower, double upper) {
  constexpr double turn = 2 * std::numbers::pi;
  const double shifted = angle + turn * std::ceil((lower - angle) / turn);
  return shifted <= upper ? shifted : angle;
}

/// The wrist as the tool pose and q7 fix it, in the base frame.
struct Wrist {
  Vector3d center;         ///< where the axes of joints 5 and 6 meet
  Vector3d x6, y6, axis6;  ///< frame of joint 6, turned by q6
};

Wrist wrist_of(const Pose& base_from_flange_wanted, double q7) {
  const Matrix3d flange = base_from_flange_wanted.rotation.toRotationMatrix();
  Wrist wrist;
  wrist.x6 = flange * Vector3d(std::cos(q7), -std::sin(q7), 0);
  wrist.axis6 = flange * Vector3d(std::sin(q7), std::cos(q7), 0);
  wrist.y6 = -flange.col(2);
  wrist.center = base_from_flange_wanted.position - kWristToFlange * flange.col(2) - kWristOffset * wrist.x6;
  return wrist;
}

/// Joint angles from the elbow frame. `x4`, `toward_elbow` (= -z5) and `z4` are unit and orthogonal, base
/// frame.
void append_solutions(const Wrist& wrist, const Vector3d& toward_elbow, const Vector3d& x4, double q7,
                      const JointLimits& limits, std::vector<JointVector>& out) {
  const Vector3d y4 = -toward_elbow, z4 = x4.cross(y4), y3 = -z4;
  const Vector3d elbow = wrist.center + kElbowToWrist * toward_elbow + kElbowOffset * x4;
  const Vector3d upper_arm = elbow - Vector3d(0, 0, kBaseToShoulder);
  const double length = upper_arm.norm();
  const Vector3d along = upper_arm / length, across = y3.cross(along);
  const Vector3d x3 = (kShoulderToElbow * across + kElbowOffset * along) / length;
  const Vector3d z3 = (kShoulderToElbow * along - kElbowOffset * across) / length;

  JointVector q{};
  q[6] = q7;
  q[3] = std::atan2(x4.dot(z3), x4.dot(x3));
  q[4] = std::atan2(wrist.axis6.dot(x4), wrist.axis6.dot(z4));
  const Vector3d z5 = -toward_elbow, x5 = wrist.axis6.cross(toward_elbow);
  q[5] = std::atan2(wrist.x6.dot(z5), wrist.x6.dot(x5));
  const double lean = std::hypot(z3.x(), z3.y());
  for (const double side : {1.0, -1.0}) {
    // Upright, the first and the third joint turn about one axis: the first is left at zero.
    q[0] = lean > 1e-12 ? std::atan2(side * z3.y(), side * z3.x()) : 0;
    q[1] = std::atan2(side * lean, z3.z());
    const Matrix3d before3 =
        rot_z(q[0]) * rot_x(-std::numbers::pi / 2) * rot_z(q[1]) * rot_x(std::numbers::pi / 2);
    q[2] = std::atan2(x3.dot(before3.col(1)), x3.dot(before3.col(0)));
    JointVector candidate = q;
    for (std::size_t i = 0; i < q.size(); ++i) {
      candidate[i] = wrapped(q[i], limits.lower[i], limits.upper[i]);
    }
    if (limits.contain(candidate)) out.push_back(candidate);
  }
}

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

JointLimits limits_of(const mjModel* model, const ArmIndices& arm) {
  JointLimits limits;
  limits.joints = arm.joints;
  for (std::size_t i = 0; i < arm.joints; ++i) {
    const mjtNum* range = model->jnt_range + 2 * arm.joint[i];
    const bool limited = model->jnt_limited[arm.joint[i]];
    limits.lower[i] = limited ? range[0] : -std::numbers::pi;
    limits.upper[i] = limited ? range[1] : std::numbers::pi;
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
      Eigen::Map<const Vector3d>(data->xanchor + 3 * arm.joint[1]) - kBaseToShoulder * z;
  const Pose flange_from_tool =
      (world_from_base * base_from_flange({})).inverse() * site_pose(data, arm.tool_site);
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
  const JointLimits limits = limits_of(model, arm);
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
  return world_from_base_ * base_from_flange(q) * flange_from_tool_;
}

std::vector<JointVector> Kinematics::solve(const Pose& world_from_tool, double q7) const {
  if (numeric_) return {};
  const Wrist wrist =
      wrist_of(world_from_base_.inverse() * world_from_tool * flange_from_tool_.inverse(), q7);
  const Vector3d to_shoulder = Vector3d(0, 0, kBaseToShoulder) - wrist.center;
  const double distance = to_shoulder.norm();
  const double upper = std::hypot(kShoulderToElbow, kElbowOffset);
  const double fore = std::hypot(kElbowToWrist, kElbowOffset);
  const double cosine = (fore * fore + distance * distance - upper * upper) / (2 * fore * distance);
  if (!(std::abs(cosine) <= 1)) return {};  // out of reach, too near, or not a number
  const Vector3d u = to_shoulder / distance;

  // The forearm's axis leaves the wrist at angle phi from the line to the shoulder (the elbow lies beside
  // that axis by a fixed angle, on either side) and is perpendicular to the sixth joint's axis.
  const double gamma = std::acos(cosine), beside = std::atan2(kElbowOffset, kElbowToWrist);
  const double ux = u.dot(wrist.x6), uy = u.dot(wrist.y6), reach = std::hypot(ux, uy);
  std::vector<JointVector> out;
  for (const double side : {1.0, -1.0}) {
    const double phi = gamma - side * beside;
    if (std::abs(std::cos(phi)) > reach || std::abs(std::sin(phi)) < 1e-9) continue;
    const double half = std::acos(std::cos(phi) / reach);
    for (const double turn : {half, -half}) {
      const double psi = std::atan2(uy, ux) + turn;
      const Vector3d toward_elbow = std::cos(psi) * wrist.x6 + std::sin(psi) * wrist.y6;
      const Vector3d normal = (toward_elbow - std::cos(phi) * u) / std::sin(phi);
      const Vector3d x4 = side * (std::cos(phi) * normal - std::sin(phi) * u);
      append_solutions(wrist, toward_elbow, x4, q7, limits_, out);
    }
  }
  return out;
}

std::vector<JointVector> Kinematics::solve_all(const Pose& world_from_tool, const JointVector& near,
                                               int samples) const {
  if (numeric_) return numeric_->solve_all(world_from_tool, near);
  std::vector<JointVector> found = solve(world_from_tool, near[6]);
  for (int i = 0; i < samples; ++i) {
    const double share = samples > 1 ? double(i) / (samples - 1) : 0.5;
    const double q7 = std::lerp(limits_.lower[6], limits_.upper[6], share);
    const auto more = solve(world_from_tool, q7);
    found.insert(found.end(), more.begin(), more.end());
  }
  std::stable_sort(found.begin(), found.end(), [&](const JointVector& a, const JointVector& b) {
    return joint_distance(a, near) < joint_distance(b, near);
  });
  return found;
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
