#include "recorder/robot.h"

#include <gtest/gtest.h>

#include <fstream>

#include "recorder/script.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

const std::string kArm =
    "joints: [a, b]\n"
    "actuators: [drive_a, drive_b]\n"
    "home: [0.5, -1]\n"
    "tool: tip\nattach: box\nhand: palm\n"
    "inverse_kinematics: numeric\n"
    "limits: {velocity: 1, acceleration: 2, deceleration: 3}\n"
    "gripper:\n"
    "  fingers:\n"
    "    - {joint: left, actuator: drive_left, open: 0, closed: 0.7}\n"
    "    - {joint: right, open: 0, closed: -0.7}\n"
    "  squeeze: 0.01\n";

class Robot : public ::testing::Test {
 protected:
  RobotDescription read(const std::string& text) {
    const auto file = folder_.path() / "arm.yaml";
    std::ofstream(file) << text;
    return read_robot(file);
  }
  /// What the reader says of `text` with `from` replaced by `to`.
  std::string complaint(const std::string& from, const std::string& to) {
    std::string text = kArm;
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
    try {
      read(text);
    } catch (const BadScript& error) {
      return error.what();
    }
    return "";
  }
  testing::TemporaryFolder folder_;
};

TEST_F(Robot, IsReadWhole) {
  const RobotDescription arm = read(kArm);
  EXPECT_EQ(arm.name, "arm");
  EXPECT_EQ(arm.joints, (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(arm.home, (std::array<double, 7>{0.5, -1, 0, 0, 0, 0, 0}));
  EXPECT_EQ(arm.tool, "tip");
  EXPECT_EQ(arm.limits.deceleration, 3);
  ASSERT_EQ(arm.fingers.size(), 2u);
  EXPECT_EQ(arm.fingers[1].actuator, "");
  EXPECT_EQ(arm.fingers[1].closed, -0.7);
  EXPECT_EQ(arm.footprint_size, (std::array<double, 2>{0, 0})) << "left out: it stands in nobody's way";
}

TEST_F(Robot, MistakesNameTheirPlace) {
  EXPECT_NE(complaint("[a, b]", "[]").find("arm.yaml:1:9: an arm has 1 to 7 joints"), std::string::npos);
  EXPECT_NE(complaint("[drive_a, drive_b]", "[drive_a]").find("arm.yaml:2:12: "), std::string::npos);
  EXPECT_NE(complaint("[0.5, -1]", "[0.5]").find("arm.yaml:3:7: 'home'"), std::string::npos);
  EXPECT_NE(complaint("numeric", "guess").find("arm.yaml:7:21: "), std::string::npos);
  EXPECT_NE(complaint("velocity: 1", "velocity: 0").find("'velocity' must be above 0"), std::string::npos);
  EXPECT_NE(complaint("closed: 0.7", "closed: 0").find("arm.yaml:11:7: "), std::string::npos);
  EXPECT_NE(complaint("actuator: drive_left, ", "").find("no finger has an actuator"), std::string::npos);
  EXPECT_NE(complaint("hand: palm", "hands: palm").find("has no key 'hands'"), std::string::npos);
  EXPECT_NE(complaint("numeric", "panda").find("a Panda has 7 joints"), std::string::npos);
  EXPECT_THROW(read_robot(folder_.path() / "none.yaml"), std::runtime_error);
}

}  // namespace
}  // namespace flowscope
