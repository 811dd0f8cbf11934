// What record refuses before the arm moves, and that it saves nothing that check, merge and train call bad.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "recorder/demo_store.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

using nlohmann::json;
using testing::contains;
using testing::Outcome;
using testing::run_command;

class RecordCommand : public ::testing::Test {
 protected:
  std::string file(const std::string& name, const std::string& text) const {
    std::ofstream(folder_.path() / name) << text;
    return (folder_.path() / name).string();
  }
  Outcome record(std::vector<std::string> words) const {
    words.insert(words.begin(), "record");
    words.insert(words.end(), {"--data", data()});
    return run_command(words);
  }
  std::string data(const std::string& name = "data") const { return (folder_.path() / name).string(); }

  const testing::TemporaryFolder folder_;
};

TEST_F(RecordCommand, AnUnknownFrameIsToldOnceWithItsPlace) {
  const std::string script = file("s.yaml",
                                  "steps:\n- gripper: close\n"
                                  "- move: {frame: teapot, position: [0, 0, 0], rpy_deg: [180, 0, 0]}\n");
  const Outcome outcome = record({"push_buttons", "--episodes", "3", "--script", script});
  EXPECT_EQ(outcome.code, 2);
  const std::string place = script + ":3:17: the scene has no frame 'teapot'";
  EXPECT_TRUE(contains(outcome.err, place)) << outcome.err;
  EXPECT_EQ(outcome.err.find("teapot"), outcome.err.rfind("teapot")) << outcome.err;
  EXPECT_FALSE(std::filesystem::exists(data()));
}

TEST_F(RecordCommand, AScriptOfAnotherTaskIsToldWithItsPlace) {
  const std::string script = file("s.yaml", "task: open_drawer\nsteps: [{gripper: close}]\n");
  const Outcome outcome = record({"push_buttons", "--script", script});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_TRUE(contains(outcome.err, script + ":1:7: the script is for task 'open_drawer'")) << outcome.err;
}

TEST_F(RecordCommand, TheSameMotionIsSavedOnce) {
  EXPECT_EQ(record({"push_buttons", "--seed", "3"}).code, 0);
  const Outcome again = record({"push_buttons", "--seed", "3", "--json"});
  EXPECT_EQ(again.code, 1);
  const json report = json::parse(again.out);
  EXPECT_EQ(report.at("saved"), 0);
  EXPECT_TRUE(contains(report.at("failed").at(0).at("reason"), "not saved: holds the same states as "))
      << report;
  EXPECT_EQ(DemoStore(data()).list().size(), 1u);
  EXPECT_EQ(run_command({"demos", "check", "--data", data()}).code, 0);
}

TEST_F(RecordCommand, ASceneWithoutAnInstructionIsAsGoodAsAnyOther) {
  const std::string scene = file("Blue_bench.xml",
                                 "<mujoco model='bench'><include file='workbench.xml'/><include "
                                 "file='ur5.xml'/><worldbody><body name='block' "
                                 "pos='0.25 0.2 0.772'><freejoint/><geom type='box' size='0.02 0.02 "
                                 "0.02'/></body></worldbody></mujoco>");
  const std::string script =
      file("s.yaml",
           "steps:\n- move: {frame: tool, position: [0.03, 0, 0.04], rpy_deg: [0, 0, 0], path: linear}\n"
           "- gripper: close\n");
  const std::vector<std::string> call{"--scene", scene, "--robot", "ur5", "--script", script};
  for (const char* silent : {"", "  ", "...!"}) {
    std::vector<std::string> more = call;
    more.insert(more.end(), {"--instruction", silent});
    const Outcome outcome = record(more);
    EXPECT_EQ(outcome.code, 2) << silent;
    EXPECT_TRUE(contains(outcome.err, "--instruction")) << outcome.err;
  }
  const Outcome recorded = record(call);
  ASSERT_EQ(recorded.code, 0) << recorded.err;
  EXPECT_EQ(DemoStore(data()).list().at(0).instruction, "blue bench");
  const Outcome check = run_command({"demos", "check", "--data", data()});
  EXPECT_EQ(check.code, 0) << check.err;
  const Outcome merge = run_command({"demos", "merge", data(), "--data", data("other"), "--json"});
  EXPECT_EQ(merge.code, 0) << merge.err;
  EXPECT_EQ(json::parse(merge.out).at("copied").size(), 1u);
  const Outcome train = run_command({"train", "--data", data("other"), "--policy", data("p.flow"), "--preset",
                                     "nano", "--steps", "1", "--json"});
  EXPECT_EQ(train.code, 0) << train.err;
}

TEST_F(RecordCommand, AMotionOfAnotherFolderThatLiesHereIsNotMergedAgain) {
  const std::vector<std::string> same{"push_buttons", "--seed", "3"};
  ASSERT_EQ(record(same).code, 0);
  ASSERT_EQ(run_command({"record", "push_buttons", "--seed", "3", "--data", data("other")}).code, 0);
  const Outcome merge = run_command({"demos", "merge", data("other"), "--data", data(), "--json"});
  EXPECT_EQ(merge.code, 0) << merge.err;
  EXPECT_EQ(json::parse(merge.out).at("identical"), 1) << "recorded at another moment, the same motion";
  EXPECT_EQ(run_command({"demos", "check", "--data", data()}).code, 0);
}

}  // namespace
}  // namespace flowscope
