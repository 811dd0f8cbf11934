#include "recorder/kinematics.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <stdexcept>

#include "recorder/numeric_arm.h"
#include "recorder/posture.h"
#include "render/mujoco_owners.h"

namespace flowscope {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// The arm's published dimensions, metres: modified Denavit-Hartenberg parameters of the Panda.
constexpr double kBaseToShoulder = 0.333, kShoulderToElbow = 0.316, kElbowToWrist = 0.384;
constexpr double kElbowOffset = 0.0825, kWristOffset = 0.088, kWristToFlange = 0.107;

struct Link {
  double a, d, alpha;
};
constexpr double kRight = std::numbers::pi / 2;
constexpr std::array<Link, 7> kLinks{{{0, kBaseToShoulder, 0},
                                      {0, 0, -kRight},
                                      {0, kShoulderToElbow, kRight},
                                      {kElbowOffset, 0, kRight},
                                      {-kElbowOffset, kElbowToWrist, -kRight},
                                      {0, 0, kRight},
                                      {kWristOffset, 0, kRight}}};

/// Calls `see(i, rotation, position)` with the frame of each joint, turned by it, in the base frame.
template <typename See>
Pose walk_links(const JointVector& q, const See& see) {
  Matrix3d rotation = Matrix3d::Identity();
  Vector3d position = Vector3d::Zero();
  for (std::size_t i = 0; i < kLinks.size(); ++i) {
    position += kLinks[i].a * rotation.col(0);
    // About x by alpha, which is a quarter turn or none: y and z change places.
    if (kLinks[i].alpha != 0) {
      const double sign = kLinks[i].alpha > 0 ? 1 : -1;
      const Vector3d y = rotation.col(1);
      rotation.col(1) = sign * rotation.col(2);
      rotation.col(2) = -sign * y;
    }
    position += kLinks[i].d * rotation.col(2);
    const double c = std::cos(q[i]), s = std::sin(q[i]);
    const Vector3d x = rotation.col(0);
    rotation.col(0) = c * x + s * rotation.col(1);
    rotation.col(1) = c * rotation.col(1) - s * x;
    see(i, rotation, position);
  }
  position += kWristToFlange * rotation.col(2);
  return {position, Eigen::Quaterniond(rotation).normalized()};
}

Pose base_from_flange_at(const JointVector& q) {
  return walk_links(q, [](std::size_t, const Matrix3d&, const Vector3d&) {});
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

Wrist wrist_of(const Pose& base_from_flange, double q7) {
  const Matrix3d flange = base_from_flange.rotation.toRotationMatrix();
  Wrist wrist;
  wrist.x6 = flange * Vector3d(std::cos(q7), -std::sin(q7), 0);
  wrist.axis6 = flange * Vector3d(std::sin(q7), std::cos(q7), 0);
  wrist.y6 = -flange.col(2);
  wrist.center = base_from_flange.position - kWristToFlange * flange.col(2) - kWristOffset * wrist.x6;
  return wrist;
}

bool within(double& angle, std::size_t joint, const JointLimits& limits) {
  angle = wrapped(angle, limits.lower[joint], limits.upper[joint]);
  return angle >= limits.lower[joint] && angle <= limits.upper[joint];
}

/// Calls `found` with the joint angles that the elbow frame leaves, within limits. `x4`, `toward_elbow`
/// (= -z5) and `z4` are unit and orthogonal, base frame. The joints that most often exceed their limits are
/// asked first.
template <typename Found>
void solve_elbow(const Wrist& wrist, const Vector3d& toward_elbow, const Vector3d& x4, double q7,
                 const JointLimits& limits, const Found& found) {
  JointVector q{};
  q[6] = q7;
  const Vector3d x5 = wrist.axis6.cross(toward_elbow);
  q[5] = std::atan2(-wrist.x6.dot(toward_elbow), wrist.x6.dot(x5));
  if (!within(q[5], 5, limits)) return;
  const Vector3d z4 = toward_elbow.cross(x4), y3 = -z4;
  const Vector3d elbow = wrist.center + kElbowToWrist * toward_elbow + kElbowOffset * x4;
  const Vector3d upper_arm = elbow - Vector3d(0, 0, kBaseToShoulder);
  const double length = upper_arm.norm();
  const Vector3d along = upper_arm / length, across = y3.cross(along);
  const Vector3d x3 = (kShoulderToElbow * across + kElbowOffset * along) / length;
  const Vector3d z3 = (kShoulderToElbow * along - kElbowOffset * across) / length;
  q[3] = std::atan2(x4.dot(z3), x4.dot(x3));
  if (!within(q[3], 3, limits)) return;
  q[4] = std::atan2(wrist.axis6.dot(x4), wrist.axis6.dot(z4));
  if (!within(q[4], 4, limits)) return;
  const double lean = std::hypot(z3.x(), z3.y());
  for (const double side : {1.0, -1.0}) {
    // Upright, the first and the third joint turn about one axis: the first is left at zero.
    const bool upright = lean <= 1e-12;
    const double c1 = upright ? 1 : side * z3.x() / lean, s1 = upright ? 0 : side * z3.y() / lean;
    q[1] = std::atan2(side * lean, z3.z());
    if (!within(q[1], 1, limits)) continue;
    q[0] = std::atan2(s1, c1);
    if (!within(q[0], 0, limits)) continue;
    // The third joint turns x3 from where the first two leave it.
    const double c2 = z3.z(), s2 = side * lean;
    const Vector3d before3_x(c1 * c2, s1 * c2, -s2), before3_y(-s1, c1, 0);
    q[2] = std::atan2(x3.dot(before3_y), x3.dot(before3_x));
    if (within(q[2], 2, limits)) found(q);
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
      (world_from_base * base_from_flange_at({})).inverse() * site_pose(data, arm.tool_site);
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
  return world_from_base_ * base_from_flange_at(q) * flange_from_tool_;
}

Pose Kinematics::base_from_flange(const Pose& world_from_tool) const {
  return world_from_base_.inverse() * world_from_tool * flange_from_tool_.inverse();
}

double Kinematics::manipulability(const JointVector& q) const {
  if (numeric_) return numeric_->manipulability(q);
  std::array<Vector3d, 7> axis, anchor;
  const Pose flange = walk_links(q, [&](std::size_t i, const Matrix3d& rotation, const Vector3d& position) {
    axis[i] = rotation.col(2);
    anchor[i] = position;
  });
  const Vector3d tool = (flange * flange_from_tool_).position;
  Eigen::Matrix<double, 6, 7> jacobian;
  for (int i = 0; i < 7; ++i) jacobian.col(i) << axis[i].cross(tool - anchor[i]), axis[i];
  const Eigen::Matrix<double, 6, 6> square = jacobian * jacobian.transpose();
  // Cholesky by hand would not be shorter; a singular matrix gives a diagonal with a zero.
  return std::sqrt(std::max(0.0, square.ldlt().vectorD().prod()));
}

struct Kinematics::Solutions {
  std::array<JointVector, 8> q;
  int count = 0;
};

void Kinematics::solve_at(const Pose& base_from_flange, double q7, Solutions& out) const {
  out.count = 0;
  const Wrist wrist = wrist_of(base_from_flange, q7);
  const Vector3d to_shoulder = Vector3d(0, 0, kBaseToShoulder) - wrist.center;
  const double distance = to_shoulder.norm();
  const double upper = std::hypot(kShoulderToElbow, kElbowOffset);
  const double fore = std::hypot(kElbowToWrist, kElbowOffset);
  const double cosine = (fore * fore + distance * distance - upper * upper) / (2 * fore * distance);
  if (!(std::abs(cosine) <= 1)) return;  // out of reach, too near, or not a number
  const Vector3d u = to_shoulder / distance;

  // The forearm's axis leaves the wrist at angle phi from the line to the shoulder (the elbow lies beside
  // that axis by a fixed angle, on either side) and is perpendicular to the sixth joint's axis.
  const double gamma = std::acos(cosine), beside = std::atan2(kElbowOffset, kElbowToWrist);
  const double ux = u.dot(wrist.x6), uy = u.dot(wrist.y6), reach = std::hypot(ux, uy);
  for (const double side : {1.0, -1.0}) {
    const double phi = gamma - side * beside, c = std::cos(phi), s = std::sin(phi);
    if (std::abs(c) > reach || std::abs(s) < 1e-9) continue;
    const double half = std::acos(c / reach);
    for (const double turn : {half, -half}) {
      const double psi = std::atan2(uy, ux) + turn;
      const Vector3d toward_elbow = std::cos(psi) * wrist.x6 + std::sin(psi) * wrist.y6;
      const Vector3d normal = (toward_elbow - c * u) / s;
      const Vector3d x4 = side * (c * normal - s * u);
      solve_elbow(wrist, toward_elbow, x4, q7, limits_, [&](const JointVector& q) {
        if (out.count < static_cast<int>(out.q.size())) out.q[static_cast<std::size_t>(out.count++)] = q;
      });
    }
  }
}

std::vector<JointVector> Kinematics::solve(const Pose& world_from_tool, double q7) const {
  if (numeric_) return {};
  Solutions found;
  solve_at(base_from_flange(world_from_tool), q7, found);
  return {found.q.begin(), found.q.begin() + found.count};
}

/// Postures and what each is worth, while they are collected.
class Kinematics::Choice {
 public:
  Choice(const Kinematics& arm, const Pose& world_from_tool, const JointVector& near)
      : arm_(arm), base_from_flange_(arm.base_from_flange(world_from_tool)), near_(near) {}

  bool in_reach() const {
    const Vector3d z = base_from_flange_.rotation * Vector3d::UnitZ();
    const Vector3d middle = base_from_flange_.position - kWristToFlange * z - Vector3d(0, 0, kBaseToShoulder);
    const double along = middle.dot(z), across = (middle - along * z).norm();
    const double nearest = std::hypot(along, across - kWristOffset);
    const double longest =
        std::hypot(kShoulderToElbow, kElbowOffset) + std::hypot(kElbowToWrist, kElbowOffset);
    return nearest <= longest;  // false for what is not a number
  }
  void see(double q7) {
    arm_.solve_at(base_from_flange_, q7, found_);
    for (int i = 0; i < found_.count; ++i) {
      const JointVector& q = found_.q[static_cast<std::size_t>(i)];
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
  Solutions found_;
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
