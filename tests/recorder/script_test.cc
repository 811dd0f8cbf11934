#include "recorder/script.h"

#include <gtest/gtest.h>

#include <numbers>

namespace flowscope {
namespace {

std::string error_of(const std::string& text) {
  try {
    parse_script(text, "s.yaml");
  } catch (const BadScript& error) {
    return error.what();
  }
  return "";
}

std::string move_with(const std::string& keys) { return "steps:\n  - move: {" + keys + "}\n"; }

TEST(Script, ReadsTheContractsExample) {
  const Script script = parse_script(R"(task: open_drawer
steps:
  - move: {frame: drawer_bottom_handle, position: [0, 0, 0.10], rpy_deg: [180, 0, 90]}   # planned
  - move: {frame: drawer_bottom_handle, position: [0, 0, 0], rpy_deg: [180, 0, 90], path: linear}
  - gripper: close
  - move: {frame: drawer_bottom_handle, position: [0, 0, 0.22], rpy_deg: [180, 0, 90], path: linear, ignore_collisions: true, yaw_symmetry: 2}
  - gripper: open
  - gripper: 0.1
)");
  EXPECT_EQ(script.task, "open_drawer");
  ASSERT_EQ(script.steps.size(), 6u);
  EXPECT_EQ(script.steps[0].line, 3);
  EXPECT_EQ(script.steps[3].line, 6);
  const auto& first = std::get<MoveStep>(script.steps[0].what);
  EXPECT_EQ(first.frame, "drawer_bottom_handle");
  EXPECT_EQ(first.frame_from_tool.position, Eigen::Vector3d(0, 0, 0.10));
  EXPECT_FALSE(first.linear);
  EXPECT_FALSE(first.ignore_collisions);
  EXPECT_EQ(first.yaw_symmetry, 1);
  const auto& pull = std::get<MoveStep>(script.steps[3].what);
  EXPECT_TRUE(pull.linear);
  EXPECT_TRUE(pull.ignore_collisions);
  EXPECT_EQ(pull.yaw_symmetry, 2);
  EXPECT_EQ(std::get<GripperStep>(script.steps[2].what).openness, 0);
  EXPECT_EQ(std::get<GripperStep>(script.steps[4].what).openness, 1);
  EXPECT_EQ(std::get<GripperStep>(script.steps[5].what).openness, 0.1);
}

TEST(Script, RollPitchYawTurnAboutFixedAxes) {
  const Script script = parse_script(move_with("position: [0, 0, 0], rpy_deg: [90, 0, 90]"));
  const auto rotation = std::get<MoveStep>(script.steps[0].what).frame_from_tool.rotation;
  // Roll about x takes z to -y; yaw about the fixed z then takes -y to x.
  EXPECT_LT((rotation * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitX()).norm(), 1e-12);
  EXPECT_LT((rotation * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm(), 1e-12);
}

TEST(Script, QuaternionIsWxyz) {
  const Script script = parse_script(move_with("position: [1, 2, 3], quaternion: [0, 1, 0, 0]"));
  const auto& move = std::get<MoveStep>(script.steps[0].what);
  EXPECT_EQ(move.frame, "world");
  EXPECT_NEAR(move.frame_from_tool.rotation.x(), 1, 1e-12);
}

TEST(Script, ErrorsNameThePlace) {
  const std::string rpy = ", rpy_deg: [180, 0, 0]";
  EXPECT_EQ(error_of("steps:\n  - move: {position: [0, .nan, 0]" + rpy + "}\n"),
            "s.yaml:2:26: 'position' needs a finite number");
  EXPECT_EQ(error_of("steps:\n  - gripper: open\n  - wave: hello\n"),
            "s.yaml:3:5: step has no key 'wave' (known: gripper, move)");
  EXPECT_EQ(error_of("steps: []\n"), "s.yaml:1:8: 'steps' is empty");
  EXPECT_EQ(error_of("task: a\n").substr(0, 11), "s.yaml:1:1:");
  EXPECT_EQ(error_of("steps:\n  - gripper: 2\n").substr(0, 12), "s.yaml:2:14:");
  EXPECT_EQ(error_of("steps:\n  - gripper: .nan\n").substr(0, 12), "s.yaml:2:14:");
  EXPECT_EQ(error_of("steps:\n  - gripper: open\n    move: {}\n").substr(0, 11), "s.yaml:2:5:");
}

TEST(Script, RefusesWhatIsNotTheGrammar) {
  const std::string rpy = ", rpy_deg: [180, 0, 0]", position = "position: [0, 0, 0]";
  for (const std::string& text : {
           std::string(),
           std::string("- a\n- b\n"),
           std::string("just words"),
           std::string("steps: {a: b}\n"),
           std::string("steps: [1, 2]\n"),
           std::string("steps:\n  - gripper: {a: b}\n"),
           std::string("steps:\n  - move: here\n"),
           std::string("steps: [\n"),
           std::string("steps:\n - gripper: \"\x01\n"),
           std::string("steps:\n  - gripper: open\n---\nsteps:\n  - gripper: open\n"),
           std::string("steps:\n  - gripper: open\nsteps:\n  - gripper: open\n"),
           move_with(position),
           move_with("rpy_deg: [0, 0, 0]"),
           move_with("position: [0, 0]" + rpy),
           move_with("position: [0, 0, x]" + rpy),
           move_with("position: [0, 0, [1]]" + rpy),
           move_with("position: 3" + rpy),
           move_with(position + rpy + ", quaternion: [1, 0, 0, 0]"),
           move_with(position + ", quaternion: [0, 0, 0, 0]"),
           move_with(position + ", quaternion: [.inf, 0, 0, 0]"),
           move_with(position + rpy + ", path: curved"),
           move_with(position + rpy + ", ignore_collisions: 3"),
           move_with(position + rpy + ", yaw_symmetry: -1"),
           move_with(position + rpy + ", yaw_symmetry: 1.5"),
           move_with(position + rpy + ", speed: 3"),
           move_with("frame: [a], " + position + rpy),
       }) {
    EXPECT_EQ(error_of(text).substr(0, 7), "s.yaml:") << text;
  }
}

TEST(Script, RefusesTextMadeToHurt) {
  EXPECT_NE(error_of("a: &a [1]\nsteps: [*a, *a]\n").find("aliases"), std::string::npos);
  EXPECT_NE(error_of(std::string(5000, '[')), "");
  EXPECT_NE(error_of("steps: " + std::string(200, '[') + std::string(200, ']')).find("deep"),
            std::string::npos);
  EXPECT_NE(error_of("steps:\n" + std::string(300 * 1024, ' ')).find("256 KiB"), std::string::npos);
  std::string many = "steps:\n";
  for (int i = 0; i < 10'001; ++i) many += "  - gripper: open\n";
  EXPECT_NE(error_of(many).find("10000"), std::string::npos);
}

TEST(Script, IsMeasuredBeforeItIsRead) {
  std::string flow = "steps: [gripper: open";
  for (int i = 0; i < 12'000; ++i) flow += ", gripper: open";
  EXPECT_NE(error_of(flow + "]").find("s.yaml:1:"), std::string::npos);
  EXPECT_NE(error_of(flow + "]").find("more than 10000 steps"), std::string::npos);
  const std::string word(200'000, 'a');
  for (const std::string& text :
       {word + ": 1", "task: " + word, "task: '" + word + "'", "task: \"" + word + "\"",
        "task: &" + word + " x", "steps: [" + word + "]", "a b " + word})
    EXPECT_NE(error_of(text).find("s.yaml:1:"), std::string::npos) << text.substr(0, 20);
  EXPECT_NE(error_of("steps:\n  - gripper: open\n  - " + word).find("s.yaml:3:"), std::string::npos);
  EXPECT_NE(error_of(std::string(40, '{')).find("deep"), std::string::npos);
  const std::string remark(100'000, 'a');
  EXPECT_EQ(error_of("# " + remark + "\nsteps:\n  - gripper: open   # " + remark + "\n"), "")
      << "a comment may be long";
  EXPECT_EQ(error_of("steps:\n" + std::string(3000, ' ') + "- gripper: open\n"), "");
  EXPECT_EQ(error_of("task: it's_[\nsteps: [{gripper: open}, {gripper: \"close\"}, {gripper: '0.5'}]\n"), "")
      << "signs inside words";
}

}  // namespace
}  // namespace flowscope
