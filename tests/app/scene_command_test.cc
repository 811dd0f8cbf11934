// --scene from the command line: what is refused, and with which words.
#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/run_command.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

using testing::contains;
using testing::run_command;

class SceneCommand : public ::testing::Test {
 protected:
  std::string file(const std::string& name, const std::string& text) const {
    const auto path = folder_.path() / name;
    std::ofstream(path) << text;
    return path.string();
  }
  testing::TemporaryFolder folder_;
};

TEST_F(SceneCommand, ABrokenSceneIsAWrongCallOfBothCommands) {
  const std::string scene = file("broken.xml", "<mujoco><worldbody><geom type='ball'/></worldbody></mujoco>");
  const std::string script = file("script.yaml", "steps: [{gripper: close}]");
  for (const auto& words : {std::vector<std::string>{"serve", "--scene", scene, "--port", "0"},
                            {"record", "--scene", scene, "--robot", "panda", "--script", script}}) {
    const auto outcome = run_command(words);
    EXPECT_EQ(outcome.code, 2) << words.front();
    EXPECT_TRUE(contains(outcome.err, "broken.xml:1: ")) << outcome.err;
    EXPECT_TRUE(contains(outcome.err, "geom")) << outcome.err;
  }
}

TEST_F(SceneCommand, AKeyFrameThatIsNotThereIsAWrongCall) {
  const std::string scene =
      file("ball.xml",
           "<mujoco><worldbody><body><freejoint/><geom size='0.1'/></body></worldbody><keyframe>"
           "<key name='low' qpos='0 0 0 1 0 0 0'/><key qpos='0 0 1 1 0 0 0'/></keyframe></mujoco>");
  const auto outcome = run_command({"serve", "--scene", scene, "--key", "high", "--port", "0"});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_TRUE(contains(outcome.err, "ball.xml: --key: there is no key frame 'high' in it (known: low, 1)"))
      << outcome.err;
  EXPECT_EQ(run_command({"serve", "--key", "low", "--port", "0"}).code, 2) << "a key frame of no scene";
}

TEST_F(SceneCommand, RecordingNeedsARobotAndAScript) {
  const std::string scene = file("ball.xml", "<mujoco><worldbody><geom size='0.1'/></worldbody></mujoco>");
  auto outcome = run_command({"record", "--scene", scene, "--script", "any.yaml"});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_TRUE(contains(outcome.err, "--robot")) << outcome.err;
  outcome = run_command({"record", "--scene", scene, "--robot", "panda"});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_TRUE(contains(outcome.err, "--script")) << outcome.err;
  outcome = run_command({"record", "--scene", scene, "--robot", "panda", "--script", scene});
  EXPECT_EQ(outcome.code, 2) << "the scene has no Panda";
  EXPECT_TRUE(contains(outcome.err, "ball.xml: the robot panda does not fit: ")) << outcome.err;
  outcome = run_command({"record", "push_buttons", "--robot", "panda"});
  EXPECT_EQ(outcome.code, 2) << "a robot without a scene";
  outcome = run_command({"record"});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_TRUE(contains(outcome.err, "TASK")) << outcome.err;
}

}  // namespace
}  // namespace flowscope
