#include "recorder/motion/panda_arm.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flowscope {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// The arm's published dimensions, metres: modified Denavit-Hartenberg parameters of the Panda.
constexpr double kBaseToShoulder = panda_shoulder_m, kShoulderToElbow = 0.316, kElbowToWrist = 0.384;
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

}  // namespace

Pose panda_base_from_flange(const JointVector& q) {
  return walk_links(q, [](std::size_t, const Matrix3d&, const Vector3d&) {});
}

double panda_manipulability(const JointVector& q, const Pose& flange_from_tool) {
  std::array<Vector3d, 7> axis, anchor;
  const Pose flange = walk_links(q, [&](std::size_t i, const Matrix3d& rotation, const Vector3d& position) {
    axis[i] = rotation.col(2);
    anchor[i] = position;
  });
  const Vector3d tool = (flange * flange_from_tool).position;
  Eigen::Matrix<double, 6, 7> jacobian;
  for (int i = 0; i < 7; ++i) jacobian.col(i) << axis[i].cross(tool - anchor[i]), axis[i];
  const Eigen::Matrix<double, 6, 6> square = jacobian * jacobian.transpose();
  return std::sqrt(std::max(0.0, square.ldlt().vectorD().prod()));
}

bool panda_in_reach(const Pose& base_from_flange) {
  const Vector3d z = base_from_flange.rotation * Vector3d::UnitZ();
  const Vector3d middle = base_from_flange.position - kWristToFlange * z - Vector3d(0, 0, kBaseToShoulder);
  const double along = middle.dot(z), across = (middle - along * z).norm();
  const double nearest = std::hypot(along, across - kWristOffset);
  const double longest = std::hypot(kShoulderToElbow, kElbowOffset) + std::hypot(kElbowToWrist, kElbowOffset);
  return nearest <= longest;  // false for what is not a number
}

PandaSolutions solve_panda(const Pose& base_from_flange, double q7, const JointLimits& limits) {
  PandaSolutions out;
  const Wrist wrist = wrist_of(base_from_flange, q7);
  const Vector3d to_shoulder = Vector3d(0, 0, kBaseToShoulder) - wrist.center;
  const double distance = to_shoulder.norm();
  const double upper = std::hypot(kShoulderToElbow, kElbowOffset);
  const double fore = std::hypot(kElbowToWrist, kElbowOffset);
  const double cosine = (fore * fore + distance * distance - upper * upper) / (2 * fore * distance);
  if (!(std::abs(cosine) <= 1)) return out;  // out of reach, too near, or not a number
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
      solve_elbow(wrist, toward_elbow, x4, q7, limits, [&](const JointVector& q) {
        if (out.count < static_cast<int>(out.q.size())) out.q[static_cast<std::size_t>(out.count++)] = q;
      });
    }
  }
  return out;
}

}  // namespace flowscope
