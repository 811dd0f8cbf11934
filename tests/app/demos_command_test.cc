// The commands that look after a store, as they are called.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "recorder/demo_file.h"
#include "recorder/demo_store.h"
#include "tests/support/run_command.h"
#include "tests/support/sample_demo.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

using nlohmann::json;
using testing::contains;
using testing::Outcome;
using testing::run_command;
using testing::sample_demo;
using testing::TemporaryFolder;

Demo sample_with_seed(std::uint64_t seed) {
  Demo demo = sample_demo();
  demo.info.seed = seed;
  for (Frame& frame : demo.frames) frame.state.ctrl.front() += static_cast<double>(seed);
  return demo;
}

json parsed(const Outcome& outcome) { return json::parse(outcome.out); }

class DemosBin : public ::testing::Test {
 protected:
  Outcome demos(std::vector<std::string> words) const {
    words.insert(words.begin(), "demos");
    words.insert(words.end(), {"--data", folder_.path().string()});
    return run_command(words);
  }
  const TemporaryFolder folder_;
  const DemoStore store_{folder_.path()};
};

TEST_F(DemosBin, DeletedIsListedRestoredAndEmptied) {
  const std::string id = store_.save(sample_with_seed(1));
  EXPECT_EQ(parsed(demos({"delete", id, "--json"})).at("deleted").at(0), id);
  json bin = parsed(demos({"bin", "list", "--json"})).at("demos");
  ASSERT_EQ(bin.size(), 1u);
  EXPECT_EQ(bin.at(0).at("id"), id);
  EXPECT_EQ(bin.at(0).at("name"), id + ".1");
  EXPECT_EQ(demos({"restore", id}).code, 0);
  EXPECT_EQ(store_.list().size(), 1u);
  EXPECT_EQ(demos({"restore", id}).code, 2) << "it is not in the bin any more";
  EXPECT_EQ(demos({"delete", id}).code, 0);
  const json emptied = parsed(demos({"bin", "empty", "--json"}));
  EXPECT_EQ(emptied.at("removed"), 1);
  EXPECT_GT(emptied.at("bytes"), 1000);
  EXPECT_EQ(parsed(demos({"bin", "list", "--json"})).at("demos").size(), 0u);
  EXPECT_EQ(demos({"restore", id}).code, 2);
}

TEST_F(DemosBin, StatsCountPerTask) {
  store_.save(sample_with_seed(1));
  store_.save(sample_with_seed(2));
  Demo other = sample_with_seed(3);
  other.info.task = "other_task";
  store_.save(other);
  const json tasks = parsed(demos({"stats", "--json"})).at("tasks");
  ASSERT_EQ(tasks.size(), 2u);
  EXPECT_EQ(tasks.at(0).at("task"), "other_task");
  EXPECT_EQ(tasks.at(1).at("demos"), 2);
  EXPECT_EQ(tasks.at(1).at("variations").at("3"), 2);
  EXPECT_EQ(tasks.at(1).at("frames").at("sum"), 40);
  EXPECT_EQ(tasks.at(1).at("keyframes").at("mean"), 2);
  EXPECT_TRUE(contains(demos({"stats"}).out, "push_buttons: 2 demonstrations of 1 variations"));
}

TEST_F(DemosBin, MergeCopiesOnceRenamesClashesAndNamesTheBroken) {
  const TemporaryFolder other;
  const DemoStore source(other.path());
  const std::string same = source.save(sample_with_seed(1));
  store_.adopt(read_demo_bytes(source.path(same)), same);
  const std::string fresh = source.adopt(encode_demo(sample_with_seed(2)), "fresh");
  source.adopt(encode_demo(sample_with_seed(3)), "clash");
  store_.adopt(encode_demo(sample_with_seed(4)), "clash");
  std::ofstream(source.path("broken")) << "FLOWDEMO and nothing more";

  Outcome outcome = demos({"merge", other.path().string(), "--json"});
  EXPECT_EQ(outcome.code, 1) << "not everything could be taken";
  EXPECT_TRUE(contains(outcome.err, "broken.demo")) << outcome.err;
  json report = parsed(outcome);
  EXPECT_EQ(report.at("copied").size(), 2u);
  EXPECT_EQ(report.at("identical"), 1);
  ASSERT_EQ(report.at("renamed").size(), 1u);
  EXPECT_EQ(report.at("renamed").at(0).at("id"), "clash-2");
  EXPECT_EQ(report.at("broken").size(), 1u);
  EXPECT_EQ(store_.list().size(), 4u);
  EXPECT_EQ(read_demo_bytes(store_.path(fresh)), read_demo_bytes(source.path(fresh)));
  EXPECT_EQ(store_.load("clash").info.seed, 4u) << "what was there keeps its id";

  std::filesystem::remove(source.path("broken"));
  outcome = demos({"merge", other.path().string(), "--json"});
  EXPECT_EQ(outcome.code, 0);
  EXPECT_EQ(parsed(outcome).at("identical"), 3) << "a second time there is nothing to do";
  EXPECT_EQ(store_.list().size(), 4u);
}

TEST_F(DemosBin, MergeRefusesItselfAndWhatIsNoDataFolder) {
  EXPECT_EQ(demos({"merge", folder_.path().string()}).code, 2);
  const Outcome outcome = demos({"merge", "/no/such/folder"});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_TRUE(contains(outcome.err, "/no/such/folder")) << outcome.err;
}

/// One real demonstration of a task that lets go at its end, with a wait before and after it.
class RealDemo : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    const auto outcome =
        run_command({"record", "push_buttons", "--seed", "4", "--data", folder_->path().string(), "--json"});
    id_ = parsed(outcome).at("demos").at(0);
  }
  static void TearDownTestSuite() { delete folder_; }
  static Outcome demos(std::vector<std::string> words) {
    words.insert(words.begin(), "demos");
    words.insert(words.end(), {"--data", folder_->path().string(), "--json"});
    return run_command(words);
  }
  static inline TemporaryFolder* folder_ = nullptr;
  static inline std::string id_;
};

TEST_F(RealDemo, ChecksAndReplaysExactlyByItsStates) {
  EXPECT_EQ(demos({"check"}).code, 0);
  const Outcome outcome = demos({"replay", id_});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  const json replay = parsed(outcome).at("demos").at(0);
  EXPECT_TRUE(replay.at("success"));
  EXPECT_EQ(replay.at("tool_mm").at("max"), 0);
  EXPECT_EQ(replay.at("joint_rad").at("max"), 0);
  EXPECT_EQ(replay.at("start_mm"), 0) << "the same scene from the same seed";
  for (const json& term : replay.at("terms")) EXPECT_TRUE(term.at("met"));
}

TEST_F(RealDemo, SimulatedAgainFromItsTargetsItIsTheSame) {
  const Outcome outcome = demos({"replay", id_, "--by", "targets"});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  const json replay = parsed(outcome).at("demos").at(0);
  EXPECT_TRUE(replay.at("success"));
  EXPECT_LT(replay.at("tool_mm").at("max"), 1e-6);
  EXPECT_LT(replay.at("object_mm").at("max"), 1e-6);
}

TEST_F(RealDemo, ReplaysByItsKeyframes) {
  const Outcome outcome = demos({"replay", "--all", "--by", "actions"});
  EXPECT_EQ(outcome.code, 0) << outcome.out;
  const json replay = parsed(outcome).at("demos").at(0);
  EXPECT_TRUE(replay.at("success"));
  EXPECT_LT(replay.at("tool_mm").at("max"), 10);
  EXPECT_GT(replay.at("tool_mm").at("max"), 0) << "other ways were planned";
}

TEST_F(RealDemo, AReplayThatDoesNotSucceedIsAFailure) {
  const DemoStore store(folder_->path());
  Demo cut = store.load(id_);
  cut.keyframes.resize(1);
  cut.frames.resize(static_cast<std::size_t>(cut.keyframes[0].frame) + 1);
  const std::string half = store.save(cut);
  for (const char* by : {"states", "actions"}) {
    const Outcome outcome = demos({"replay", half, "--by", by});
    EXPECT_EQ(outcome.code, 1) << by;
    EXPECT_FALSE(parsed(outcome).at("demos").at(0).at("success")) << by;
  }
  store.remove(half);
}

TEST_F(RealDemo, TrimCutsAWaitAndPhotographsTheNewStart) {
  const DemoStore store(folder_->path());
  Demo waiting = store.load(id_);
  const Frame first = waiting.frames.front();
  waiting.frames.insert(waiting.frames.begin(), 5, first);
  for (std::size_t i = 0; i < waiting.frames.size(); ++i) {
    waiting.frames[i].time_s = waiting.frames[i].state.time_s = 0.05 * static_cast<double>(i);
  }
  for (Keyframe& keyframe : waiting.keyframes) keyframe.frame += 5;
  waiting.start.views[0].rgb.data.assign(waiting.start.views[0].rgb.data.size(), 7);
  const std::string id = "waiting";  // past the store: its first picture has one colour
  const Bytes bytes = encode_demo(waiting);
  std::ofstream(store.path(id), std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));

  const json dry = parsed(demos({"trim", id, "--dry-run"}));
  const int at_start = dry.at("demos").at(0).at("cut_start");
  EXPECT_GE(at_start, 5);
  EXPECT_EQ(store.load(id).frames.size(), waiting.frames.size()) << "a dry run changes nothing";

  EXPECT_EQ(parsed(demos({"trim", id})).at("changed"), 1);
  const Demo cut = store.load(id);
  EXPECT_EQ(cut.keyframes.size(), waiting.keyframes.size());
  EXPECT_EQ(cut.frames.front().state, waiting.frames[static_cast<std::size_t>(at_start)].state);
  EXPECT_EQ(cut.start.views.size(), 4u);
  EXPECT_NE(cut.start.views[0].rgb, waiting.start.views[0].rgb) << "taken anew";
  ASSERT_EQ(store.bin().list().size() > 0, true);
  EXPECT_EQ(parsed(demos({"trim", id})).at("changed"), 0);
  EXPECT_EQ(parsed(demos({"replay", id})).at("demos").at(0).at("success"), true);
  store.remove(id);
}

TEST_F(RealDemo, RendersWhatWasRecordedAndOtherViewsToo) {
  const TemporaryFolder out;
  const auto report = parsed(demos({"render", id_, "--camera", "front", "--width", "128", "--height", "128",
                                    "--frame", "0", "--depth", "--out", out.path().string()}));
  const json file = report.at("files").at(0);
  EXPECT_GT(std::filesystem::file_size(file.at("picture").get<std::string>()), 1000u);
  EXPECT_GT(std::filesystem::file_size(file.at("depth").get<std::string>()), 1000u);
  EXPECT_NEAR(file.at("camera").at("fx"), DemoStore(folder_->path()).load(id_).start.views[0].camera.fx,
              1e-9);

  const json orbit =
      parsed(demos({"render", id_, "--camera", "orbit", "--azimuth-deg", "90", "--width", "200", "--height",
                    "100", "--keyframes", "--out", (out.path() / "o").string()}));
  EXPECT_EQ(orbit.at("files").size(), DemoStore(folder_->path()).load(id_).keyframes.size() + 1);

  EXPECT_EQ(demos({"render", id_, "--camera", "nowhere", "--out", out.path().string()}).code, 2);
  EXPECT_EQ(demos({"render", id_, "--frame", "100000", "--out", out.path().string()}).code, 2);
  EXPECT_EQ(demos({"render", id_, "--depth", "--out", (out.path() / "x.mp4").string()}).code, 2);
  EXPECT_EQ(demos({"render", "nothing", "--out", out.path().string()}).code, 2);
}

}  // namespace
}  // namespace flowscope
