#include "recorder/motion/numeric_arm.h"

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <array>
#include <cmath>
#include <random>
#include <stdexcept>

#include "recorder/motion/trajectory.h"
#include "render/mujoco_owners.h"

namespace flowscope {
namespace {

ModelPtr robot_model(const std::string& name) {
  const std::string file = FLOWSCOPE_SOURCE_DIR "/assets/robots/" + name + ".xml";
  std::array<char, 500> error{};
  ModelPtr model(mj_loadXML(file.c_str(), nullptr, error.data(), static_cast<int>(error.size())));
  if (!model) throw std::runtime_error(error.data());
  return model;
}

RobotDescription description(const std::string& name) {
  return read_robot(FLOWSCOPE_SOURCE_DIR "/assets/robots/" + name + ".yaml");
}

Kinematics ur5() { return Kinematics::from_model(robot_model("ur5").get(), description("ur5")); }

/// Within the limits, a tenth of the range away from them.
JointVector random_joints(const JointLimits& limits, std::mt19937_64& random) {
  JointVector q{};
  for (std::size_t i = 0; i < limits.joints; ++i) {
    const double share = std::uniform_real_distribution<double>(0.1, 0.9)(random);
    q[i] = std::lerp(limits.lower[i], limits.upper[i], share);
  }
  return q;
}

bool same_pose(const Pose& a, const Pose& b) {
  return position_error_m(a, b) < 1e-6 && rotation_error_rad(a, b) < 1e-6;
}

TEST(NumericArm, TheUr5HasItsPublishedLengths) {
  const Pose tool = ur5().world_from_tool({});
  // The flange at zero lies at (-a2 - a3, d4 + d6, d1 - d5) in a base turned by half a turn and looks along
  // y.
  const Eigen::Vector3d base(-0.268, 0, 0.752), flange(0.425 + 0.39225, 0.10915 + 0.0823, 0.089159 - 0.09465);
  EXPECT_LT((tool.position - base - flange - Eigen::Vector3d(0, 0.228, 0)).norm(), 1e-9);
  EXPECT_LT((tool.rotation * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitY()).norm(), 1e-9);
}

TEST(NumericArm, RecoversRandomPosesOfTheUr5) {
  const Kinematics arm = ur5();
  std::mt19937_64 random(1);
  constexpr int n = 400;
  int recovered = 0, solutions = 0;
  for (int i = 0; i < n; ++i) {
    const Pose wanted = arm.world_from_tool(random_joints(arm.limits(), random));
    const JointVector near = random_joints(arm.limits(), random);
    const auto found = arm.solve_all(wanted, near);
    recovered += !found.empty();
    solutions += static_cast<int>(found.size());
    for (std::size_t k = 0; k < found.size(); ++k) {
      EXPECT_TRUE(same_pose(arm.world_from_tool(found[k]), wanted));
      EXPECT_TRUE(arm.limits().contain(found[k]));
      EXPECT_EQ(found[k][6], 0) << "a joint that the arm has not";
      for (std::size_t j = 0; j < k; ++j) EXPECT_GE(joint_distance(found[j], found[k]), 0.05);
    }
  }
  EXPECT_GE(recovered, n * 0.99);
  EXPECT_GT(solutions, 3 * n) << "of up to eight";
}

TEST(NumericArm, StaysWhereItStands) {
  const Kinematics arm = ur5();
  const JointVector home = description("ur5").home;
  const auto found = arm.solve_all(arm.world_from_tool(home), home);
  ASSERT_FALSE(found.empty());
  EXPECT_LT(joint_distance(found.front(), home), 1e-6);
}

TEST(NumericArm, OutOfReachHasNoSolution) {
  const Kinematics arm = ur5();
  const JointVector home = description("ur5").home;
  Pose far = arm.world_from_tool(home);
  far.position.x() += 2;
  EXPECT_TRUE(arm.solve_all(far, home).empty());
  far.position.x() = std::nan("");
  EXPECT_TRUE(arm.solve_all(far, home).empty());
  EXPECT_FALSE(arm.follow(far, home, home));
}

TEST(NumericArm, AgreesWithThePandasClosedForm) {
  const ModelPtr model = robot_model("panda");
  RobotDescription robot = description("panda");
  const Kinematics closed_form = Kinematics::from_model(model.get(), robot);
  robot.inverse_kinematics = InverseKinematics::numeric;
  const Kinematics numeric = Kinematics::from_model(model.get(), robot);
  std::mt19937_64 random(2);
  constexpr int n = 100;
  int solved = 0, as_near = 0;
  for (int i = 0; i < n; ++i) {
    const JointVector q = random_joints(closed_form.limits(), random);
    const Pose wanted = closed_form.world_from_tool(q);
    EXPECT_LT(position_error_m(wanted, numeric.world_from_tool(q)), 1e-9);
    // From a posture nearby, as a motion has it.
    JointVector near = q;
    for (double& angle : near) angle += std::uniform_real_distribution<double>(-0.3, 0.3)(random);
    const auto found = numeric.solve_all(wanted, near), expected = closed_form.solve_all(wanted, near);
    ASSERT_FALSE(expected.empty());
    solved += !found.empty();
    for (const auto& solution : found) {
      EXPECT_TRUE(same_pose(closed_form.world_from_tool(solution), wanted));
      EXPECT_TRUE(numeric.limits().contain(solution));
    }
    as_near +=
        !found.empty() && joint_distance(found.front(), near) < joint_distance(expected.front(), near) + 0.1;
  }
  EXPECT_GE(solved, n * 0.99);
  EXPECT_GE(as_near, n * 0.9);
}

TEST(NumericArm, LeadsTheToolAlongALine) {
  const Kinematics arm = ur5();
  const JointVector home = description("ur5").home;
  const Pose from = arm.world_from_tool(home);
  Pose to = from;
  to.position += Eigen::Vector3d(0.1, -0.15, -0.1);
  const JointPath path = straight_tool_path(arm, home, to);
  ASSERT_GT(path.size(), 20u);
  EXPECT_TRUE(same_pose(arm.world_from_tool(path.back()), to));
  const Eigen::Vector3d along = (to.position - from.position).normalized();
  for (std::size_t i = 1; i < path.size(); ++i) {
    EXPECT_LT(joint_distance(path[i - 1], path[i]), 0.12);
    const Pose tool = arm.world_from_tool(path[i]);
    EXPECT_LT((tool.position - from.position).cross(along).norm(), 1e-6);
    EXPECT_LT(rotation_error_rad(tool, from), 1e-6);
  }
  to.position.x() += 1;
  double reached = 1;
  EXPECT_TRUE(straight_tool_path(arm, home, to, &reached).empty());
  EXPECT_LT(reached, 1);
}

TEST(NumericArm, RefusesAnArmWithFurtherJoints) {
  RobotDescription robot = description("ur5");
  robot.joints.erase(robot.joints.begin() + 2);
  EXPECT_THROW(Kinematics::from_model(robot_model("ur5").get(), robot), std::runtime_error);
  robot.joints[0] = "shoulder";
  EXPECT_THROW(Kinematics::from_model(robot_model("ur5").get(), robot), std::runtime_error);
}

}  // namespace
}  // namespace flowscope
