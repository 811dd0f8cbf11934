// What a demonstration's file says of where it comes from, and what it does not.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <nlohmann/json.hpp>

#include "recorder/demo_file.h"
#include "recorder/formats/demo_arrays.h"
#include "recorder/formats/npz_demos.h"
#include "recorder/formats/robomimic_file.h"
#include "recorder/record.h"
#include "recorder/world.h"
#include "tests/support/same_demo.h"
#include "tests/support/sample_demo.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

using Json = nlohmann::ordered_json;
using testing::sample_demo;
using testing::stored;

/// Of an arm of six joints in a user's own scene.
Demo scene_demo() {
  Demo demo = sample_demo();
  demo.info.origin = {"ur5", 6,
                      SceneOrigin{"scenes/desk.xml", "mine.yaml", "/home/me", std::string(64, 'a'),
                                  std::string(64, '0'), "open"}};
  demo.info.success = false;
  for (Frame& frame : demo.frames) frame.q[6] = frame.dq[6] = 0;
  return demo;
}

std::string problem_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

TEST(DemoOrigin, IsInTheFileAndInTheList) {
  const testing::TemporaryFolder folder;
  const DemoStore store(folder.path());
  const Demo demo = scene_demo();
  const std::string id = store.save(demo);
  const DemoInfo loaded = store.load(id).info, listed = store.list().front();
  for (const DemoInfo& info : {loaded, listed}) {
    EXPECT_EQ(info.origin, demo.info.origin);
    EXPECT_EQ(info.success, false);
    EXPECT_TRUE(info.unfinished());
  }
}

TEST(DemoOrigin, AnOlderFileSaysNothingAndStaysTheSame) {
  const Bytes file = encode_demo(sample_demo());
  const std::string text(file.begin(), file.end());
  for (const char* key : {"\"robot\"", "\"success\"", "\"scene\":{"}) {
    EXPECT_EQ(text.find(key), std::string::npos) << key;
  }
  const Demo demo = decode_demo(file, "x.demo", DemoParts::all);
  EXPECT_EQ(demo.info.origin, DemoOrigin{});
  EXPECT_EQ(demo.info.success, std::nullopt);
  EXPECT_FALSE(demo.info.unfinished()) << "not known is not unfinished";
  EXPECT_EQ(encode_demo(demo), file);
}

TEST(DemoOrigin, WhatIsWrongIsNamedByItsKey) {
  const Json good = Json::parse(to_json_text(describe_demo(scene_demo())));
  const auto complaint = [&](const std::function<void(Json&)>& change) {
    Json json = good;
    change(json);
    return problem_of([&] { parse_demo_header(json.dump()); });
  };
  EXPECT_EQ(complaint([](Json&) {}), "");
  EXPECT_EQ(complaint([](Json& j) { j["robot"] = "ur5"; }), "header.robot lacks \"name\"");
  EXPECT_EQ(complaint([](Json& j) { j["robot"]["name"] = 5; }), "header.robot.name is not text");
  EXPECT_EQ(complaint([](Json& j) { j["robot"]["name"] = std::string(256, 'x'); }),
            "header.robot.name has more than 255 characters");
  EXPECT_EQ(complaint([](Json& j) { j["robot"]["name"] = ""; }), "header.robot.name is empty");
  EXPECT_EQ(complaint([](Json& j) { j["robot"]["joints"] = 8; }), "header.robot.joints is above 7");
  EXPECT_EQ(complaint([](Json& j) { j["robot"]["joints"] = 0; }), "header.robot.joints is 0");
  EXPECT_EQ(complaint([](Json& j) { j["robot"]["joints"] = -1; }),
            "header.robot.joints is not a whole number");
  EXPECT_EQ(complaint([](Json& j) { j["scene"].erase("sha256"); }), "header.scene lacks \"sha256\"");
  EXPECT_EQ(complaint([](Json& j) { j["scene"]["sha256"] = ""; }), "header.scene.sha256 is empty");
  EXPECT_EQ(complaint([](Json& j) { j["scene"]["sha256"] = std::string(64, 'g'); }),
            "header.scene.sha256 is not a SHA-256");
  EXPECT_EQ(complaint([](Json& j) { j["scene"]["robot_sha256"] = "12"; }),
            "header.scene.robot_sha256 is not a SHA-256");
  EXPECT_EQ(complaint([](Json& j) { j["scene"]["file"] = std::string(5'000, 'x'); }),
            "header.scene.file has more than 4096 characters");
  EXPECT_EQ(complaint([](Json& j) { j["scene"]["file"] = ""; }), "header.scene.file is empty");
  EXPECT_EQ(complaint([](Json& j) { j["success"] = "yes"; }), "header.success is neither true nor false");
}

TEST(DemoOrigin, ArraysHaveTheColumnsOfTheArm) {
  const Demo demo = stored(scene_demo());
  int seen = 0;
  for (const NamedArray& array : arrays_of(demo, ArrayParts::all)) {
    if (array.name != "frame/q" && array.name != "frame/dq") continue;
    EXPECT_EQ(array.spec.shape, (std::vector<std::uint64_t>{20, 6})) << array.name;
    ++seen;
  }
  EXPECT_EQ(seen, 2);
  Demo wrong = demo;
  wrong.frames[3].q[6] = 0.1;
  EXPECT_EQ(problem_of([&] { arrays_of(wrong, ArrayParts::all); }),
            "frame 3 holds more than the 6 joints of its robot");
}

TEST(DemoOrigin, ComesBackFromEveryKindOfFile) {
  const testing::TemporaryFolder folder;
  const Demo demo = stored(scene_demo());
  NpzDemoWriter npz(folder.path() / "d.npz");
  npz.add(demo);
  npz.finish();
  testing::expect_same_demo(NpzDemoReader(folder.path() / "d.npz").read(0), demo);
  RobomimicWriter hdf5(folder.path() / "d.hdf5");
  hdf5.add(demo, {});
  hdf5.finish();
  const auto masks = Hdf5Reader(folder.path() / "d.hdf5").children("mask");
  EXPECT_NE(std::ranges::find(masks, "unfinished"), masks.end()) << "nobody shall train on it unasked";
  testing::expect_same_demo(RobomimicReader(folder.path() / "d.hdf5").read(0), demo);
}

TEST(DemoOrigin, OneHdf5FileTakesArmsOfOneKind) {
  const testing::TemporaryFolder folder;
  RobomimicWriter writer(folder.path() / "d.hdf5");
  writer.add(stored(scene_demo()), {});
  const std::string problem = problem_of([&] { writer.add(stored(sample_demo()), {}); });
  EXPECT_NE(problem.find("7 joints, that of those before 6"), std::string::npos) << problem;
}

/// Saved before anything was reached, as a session by hand can be.
TEST(DemoOrigin, ARecordingNamesItsRobotAndWhetherItSucceeded) {
  static const TaskLibrary library(FLOWSCOPE_SOURCE_DIR "/assets");
  for (const auto& [task, robot, joints] :
       {std::tuple("push_buttons", "panda", 7), std::tuple("put_fruit_in_bowl", "ur5", 6)}) {
    World world(library.get(task));
    world.reset(0, 1);
    const auto q = world.joint_targets();
    const std::vector<Frame> frames{world.frame(), world.advance(q, 1)};
    const Demo demo = make_demo(world, frames, {1}, [](const SceneState&) { return Observation{}; });
    EXPECT_EQ(demo.info.origin, (DemoOrigin{robot, joints, std::nullopt}));
    EXPECT_EQ(demo.info.success, false);
  }
}

}  // namespace
}  // namespace flowscope
