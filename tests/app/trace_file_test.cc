// Reading trace files: bounds, places in messages, and the scene that a trace claims.
#include "app/trace_file.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "app/cli.h"
#include "app/scene_input.h"
#include "app/trace_store.h"
#include "recorder/world.h"
#include "tests/support/fake_values.h"
#include "tests/support/run_command.h"
#include "tests/support/sample_demo.h"
#include "tests/support/temporary_folder.h"

namespace flowscope::app {
namespace {

using nlohmann::ordered_json;
using testing::contains;
using testing::run_command;

class TraceFile : public ::testing::Test {
 protected:
  TraceFile() { write_trace_file(file_, {testing::fake_trace("t1", 4, 7)}); }

  void write(const std::string& text) { std::ofstream(file_) << text; }
  ordered_json read() { return ordered_json::parse(std::ifstream(file_)); }
  std::string complaint() {
    try {
      read_trace_file(file_);
    } catch (const UsageError& error) {
      return error.what();
    }
    return "";
  }
  template <typename Change>
  std::string complaint_after(Change&& change) {
    ordered_json json = read();
    change(json);
    write(json.dump());
    return complaint();
  }

  const testing::TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_.path() / "trace.json";
};

TEST_F(TraceFile, WhatWasWrittenIsReadOneOrSeveral) {
  EXPECT_EQ(read_trace_file(file_).size(), 1u);
  write_trace_file(file_, {testing::fake_trace("t1", 4, 7), testing::fake_trace("t2", 4, 8)});
  EXPECT_EQ(read_trace_file(file_).at(1).id, "t2");
}

TEST_F(TraceFile, NamesFileAndPlace) {
  EXPECT_EQ(complaint_after([](auto& j) {
              j["steps"][3]["pose"]["quaternion"] = {1, 1, 0, 0};
            }),
            file_.string() + ": steps[3].pose.quaternion: must be a unit quaternion w,x,y,z");
}

TEST_F(TraceFile, NamesThePlaceInAListOfSamples) {
  const std::string said = complaint_after([](auto& j) {
    ordered_json broken = j;
    broken["steps"] = ordered_json::array();
    j = ordered_json::array({j, broken});
  });
  EXPECT_TRUE(said.starts_with(file_.string() + ": [1].steps: ")) << said;
}

TEST_F(TraceFile, SamplesShareTheirScene) {
  const std::string said = complaint_after([](auto& j) {
    ordered_json other = j;
    other["scene"]["seed"] = 8;
    j = ordered_json::array({j, other});
  });
  EXPECT_TRUE(contains(said, ": [1].scene: ")) << said;
}

TEST_F(TraceFile, RefusesWhatIsNoTrace) {
  const std::string deep(100'000, '[');
  std::string wide = "[0";
  for (int i = 0; i < 4'000'001; ++i) wide += ",0";
  const std::vector<std::pair<std::string, std::string>> cases{{"", "not JSON"},
                                                               {"{", "not JSON"},
                                                               {"[]", "holds no trace"},
                                                               {"7", "must be an object"},
                                                               {"[7]", "[0]"},
                                                               {deep, "nested deeper"},
                                                               {wide + "]", "4 million"},
                                                               {"{\"a\":1,\"a\":2}", "appears twice"},
                                                               {"\xff\xfe", "not JSON"},
                                                               {"{\"format\":1e999}", "not JSON"},
                                                               {"{}", "format: is missing"}};
  for (const auto& [text, expected] : cases) {
    write(text);
    const std::string said = complaint();
    EXPECT_TRUE(said.starts_with(file_.string() + ": ") && contains(said, expected))
        << text.substr(0, 40) << ": " << said;
    EXPECT_LT(said.size(), 400u);
  }
}

TEST_F(TraceFile, AFileThatIsNotThereOrAFolderIsAWrongCall) {
  EXPECT_THROW(read_trace_file(folder_.path() / "none.json"), UsageError);
  EXPECT_THROW(read_trace_file(folder_.path()), UsageError);
}

TEST_F(TraceFile, AFilmOfNoStepsOrOfAnotherPlaceIsExitTwo) {
  const auto draw = [&] {
    return run_command({"export", "strip", "--data", folder_.path().string(), "--trace", file_.string(),
                        "--out", (folder_.path() / "s.png").string()});
  };
  for (const char* task : {"../../etc", "no_such_task"}) {
    complaint_after([&](auto& j) { j["scene"]["task"] = task; });
    const auto refused = draw();
    EXPECT_EQ(refused.code, 2) << refused.err;
    EXPECT_TRUE(contains(refused.err, file_.string() + ": scene.task: ")) << refused.err;
  }
  complaint_after([](auto& j) { j["steps"] = ordered_json::array(); });
  const auto empty = draw();
  EXPECT_EQ(empty.code, 2) << empty.err;
  EXPECT_TRUE(contains(empty.err, file_.string() + ": steps: ")) << empty.err;
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "s.png"));
}

/// The scene that a trace claims, or the complaint about it.
class SceneOfTrace : public TraceFile {
 protected:
  std::string scene_complaint(const FlowTrace& trace) {
    try {
      scene_of_trace(tasks_, store_, trace, file_);
    } catch (const UsageError& error) {
      return error.what();
    }
    return "";
  }
  const TaskLibrary tasks_{find_assets()};
  const DemoStore store_{folder_.path()};
  FlowTrace trace_ = testing::fake_trace("t1", 4, 7);
};

TEST_F(SceneOfTrace, OfADemonstrationIsComparedWithIt) {
  trace_.scene.demo = store_.save(testing::sample_demo());
  trace_.scene.keyframe = 1;
  EXPECT_TRUE(contains(scene_complaint(trace_), file_.string() + ": scene.state_sha256: "))
      << "another state";
  const SceneState state = testing::sample_demo().frames[10].state;
  trace_.scene.state_sha256 = state_sha256(store_.load(*trace_.scene.demo).frames[10].state);
  EXPECT_EQ(scene_of_trace(tasks_, store_, trace_, file_).qpos, state.qpos);
  trace_.scene.keyframe = 3;
  EXPECT_TRUE(contains(scene_complaint(trace_), ": scene.keyframe: "));
  trace_.scene.task = "open_drawer";
  EXPECT_TRUE(contains(scene_complaint(trace_), ": scene.task: "));
  trace_.scene.demo = "none";
  EXPECT_TRUE(contains(scene_complaint(trace_), ": scene.demo: "));
}

TEST_F(SceneOfTrace, OfAResetIsComparedAloud) {
  ::testing::internal::CaptureStderr();
  EXPECT_EQ(scene_complaint(trace_), "");
  EXPECT_TRUE(contains(::testing::internal::GetCapturedStderr(), "scene.state_sha256"));
  World world(tasks_.get("push_buttons"));
  world.reset(0, 7);
  trace_.scene.state_sha256 = state_sha256(world.state());
  ::testing::internal::CaptureStderr();
  EXPECT_EQ(scene_complaint(trace_), "");
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  trace_.scene.variation = 1000;
  EXPECT_TRUE(contains(scene_complaint(trace_), ": scene.variation: "));
  trace_.scene.variation = 0;
  trace_.scene.keyframe = 2;
  EXPECT_TRUE(contains(scene_complaint(trace_), ": scene.keyframe: "));
}

}  // namespace
}  // namespace flowscope::app
