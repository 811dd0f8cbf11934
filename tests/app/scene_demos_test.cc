// A demonstration in a user's own scene, on the second robot: every part of `demos` finds the scene by
// itself, says what is missing or has changed, and takes another one on request.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "recorder/demo_file.h"
#include "recorder/demo_store.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

using nlohmann::json;
using testing::contains;
using testing::Outcome;
using testing::run_command;

const std::string kBlock =
    "<mujoco><worldbody><body name='block' pos='0.25 0.2 0.772'><freejoint/>"
    "<geom type='box' size='0.02 0.02 0.02' rgba='0.8 0.2 0.1 1'/></body></worldbody></mujoco>";

class SceneDemos : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new testing::TemporaryFolder;
    const auto before = std::filesystem::current_path();
    std::filesystem::create_directories(folder_->path() / "work");
    std::filesystem::current_path(folder_->path() / "work");
    write("bench.xml",
          "<mujoco model='bench'><include file='workbench.xml'/><include file='ur5.xml'/>"
          "<include file='block.xml'/></mujoco>");
    write("block.xml", kBlock);
    write("script.yaml",
          "steps:\n"
          "- move: {frame: tool, position: [0.03, 0, 0.04], rpy_deg: [0, 0, 0], path: linear}\n"
          "- gripper: close\n"
          "- move: {frame: tool, position: [0, 0, -0.04], rpy_deg: [0, 0, 15], path: linear}\n");
    const Outcome outcome = run_command({"record", "--scene", "bench.xml", "--robot", "ur5", "--script",
                                         "script.yaml", "--instruction", "wave", "--data", data(), "--json"});
    std::filesystem::current_path(before);
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    id_ = json::parse(outcome.out).at("demos").at(0);
  }
  static void TearDownTestSuite() { delete folder_; }
  void TearDown() override { write("block.xml", kBlock); }

  static void write(const std::string& name, const std::string& text) {
    std::ofstream(folder_->path() / "work" / name) << text;
  }
  static std::string data() { return (folder_->path() / "data").string(); }
  static std::string work(const std::string& name) { return (folder_->path() / "work" / name).string(); }
  static Outcome demos(std::vector<std::string> words) {
    words.insert(words.begin(), "demos");
    words.insert(words.end(), {"--data", data(), "--json"});
    return run_command(words);
  }
  static inline testing::TemporaryFolder* folder_ = nullptr;
  static inline std::string id_;
};

TEST_F(SceneDemos, ListAndShowNameRobotAndScene) {
  const json listed = json::parse(demos({"list"}).out).at("demos").at(0);
  EXPECT_EQ(listed.at("robot"), "ur5");
  EXPECT_EQ(listed.at("scene"), "bench.xml");
  EXPECT_EQ(listed.at("success"), nullptr) << "a scene without success terms";
  const std::string shown = run_command({"demos", "show", id_, "--data", data()}).out;
  EXPECT_TRUE(contains(shown, "robot        ur5, 6 joints")) << shown;
  EXPECT_TRUE(contains(shown, "scene        bench.xml, robot ur5, from ")) << shown;
  const json kind = json::parse(demos({"stats"}).out).at("tasks").at(0);
  EXPECT_EQ(kind.at("robot"), "ur5");
  EXPECT_EQ(kind.at("scene"), "bench.xml");
}

TEST_F(SceneDemos, ReplayTrimAndRenderFindTheScene) {
  for (const char* by : {"states", "targets", "actions"}) {
    const Outcome outcome = demos({"replay", id_, "--by", by});
    EXPECT_EQ(outcome.code, 0) << by << ": " << outcome.err << outcome.out;
  }
  const testing::TemporaryFolder out;
  const Outcome render = demos({"render", id_, "--frame", "0", "--out", out.path().string()});
  EXPECT_EQ(render.code, 0) << render.err;

  const DemoStore store(data());
  Demo waiting = store.load(id_);
  waiting.frames.insert(waiting.frames.begin(), 5, waiting.frames.front());
  for (std::size_t i = 0; i < waiting.frames.size(); ++i) {
    waiting.frames[i].time_s = waiting.frames[i].state.time_s = 0.05 * static_cast<double>(i);
  }
  for (Keyframe& keyframe : waiting.keyframes) keyframe.frame += 5;
  const std::string id = store.save(waiting);
  const Outcome trim = demos({"trim", id});
  EXPECT_EQ(trim.code, 0) << trim.err;
  EXPECT_EQ(json::parse(trim.out).at("changed"), 1);
  EXPECT_EQ(store.load(id).info.origin, waiting.info.origin);
  store.remove(id);
}

TEST_F(SceneDemos, EveryExportComesBackByteForByteAndOnce) {
  const Bytes before = read_demo_bytes(DemoStore(data()).path(id_));
  const testing::TemporaryFolder out;
  for (const std::string format : {"--npz", "--hdf5", "--rlbench"}) {
    const std::string target = (out.path() / format.substr(2)).string();
    std::vector<std::string> words{"export", format, target, id_};
    if (format != "--npz") words.insert(words.end(), {"--pictures", "all"});
    const Outcome exported = demos(words);
    ASSERT_EQ(exported.code, 0) << exported.err;
    EXPECT_FALSE(contains(exported.err, "without its scene")) << exported.err;
    const testing::TemporaryFolder back;
    const std::vector<std::string> import{"demos", "import", format, target, "--data", back.path().string(),
                                          "--json"};
    const json first = json::parse(run_command(import).out), second = json::parse(run_command(import).out);
    EXPECT_EQ(first.at("known"), 0);
    EXPECT_EQ(second.at("known"), 1) << format << ": imported twice";
    EXPECT_EQ(second.at("imported").size(), 0u);
    const DemoStore store(back.path());
    ASSERT_EQ(store.list().size(), 1u) << format;
    EXPECT_EQ(read_demo_bytes(store.path(first.at("imported").at(0))), before) << format;
  }
}

TEST_F(SceneDemos, WhatHasChangedOrGoneIsNamedAndAnotherSceneTaken) {
  std::string repainted = kBlock;
  repainted.replace(repainted.find("0.8 0.2 0.1"), 11, "0.1 0.2 0.8");
  write("block.xml", repainted);
  const testing::TemporaryFolder out;
  const std::vector<std::vector<std::string>> calls = {
      {"replay", id_},
      {"render", id_, "--frame", "0", "--out", out.path().string()},
      {"export", "--rlbench", (out.path() / "r").string()}};
  for (const auto& call : calls) {
    const Outcome outcome = demos(call);
    EXPECT_EQ(outcome.code, 2) << call[0];
    EXPECT_TRUE(contains(outcome.err, "bench.xml, the scene that it was recorded in, has changed since"))
        << outcome.err;
  }
  const Outcome check = demos({"check"});
  EXPECT_EQ(check.code, 0) << "the demonstration itself is whole";
  EXPECT_EQ(json::parse(check.out).at("lost_scenes").at(0).at("demos"), json({id_}));
  const Outcome npz = demos({"export", "--hdf5", (out.path() / "h.hdf5").string()});
  EXPECT_EQ(npz.code, 0) << "what the file holds needs no scene: " << npz.err;

  EXPECT_EQ(demos({"replay", id_, "--scene", work("bench.xml"), "--robot", "ur5"}).code, 0)
      << "taken as it is now, on request";
  std::filesystem::rename(work("bench.xml"), work("other.xml"));
  const Outcome gone = demos({"replay", id_});
  std::filesystem::rename(work("other.xml"), work("bench.xml"));
  EXPECT_EQ(gone.code, 2);
  EXPECT_TRUE(contains(gone.err, work("bench.xml") + ", the scene that it was recorded in, is not there"))
      << gone.err;
}

}  // namespace
}  // namespace flowscope
