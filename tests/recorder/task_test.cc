#include "recorder/task.h"

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>

#include "recorder/task_folder.h"
#include "recorder/task_placement.h"
#include "recorder/task_random.h"
#include "recorder/task_variations.h"
#include "recorder/world.h"

namespace flowscope {
namespace {

const std::filesystem::path kAssets = FLOWSCOPE_SOURCE_DIR "/assets";

TEST(TaskTree, KnowsEveryPlace) {
  const TaskReader reader("t.yaml");
  const TaskNode root = reader.parse("a: 1\nb:\n  - {c: x}\n");
  EXPECT_EQ(root.find("a")->line, 1);
  EXPECT_EQ(root.find("b")->items.at(0).find("c")->line, 3);
  EXPECT_EQ(root.find("b")->items.at(0).find("c")->column, 9);
}

TEST(TaskTree, FillsPlaceholdersAndRepeats) {
  const TaskReader reader("t.yaml");
  const TaskNode root = reader.parse(
      "[\"{color_{n}}\", {repeat: \"{n}\", each: [\"b{i}\", {x: \"{color_{i}}\"}]}, {repeat: 1, from: 2, "
      "each: [never]}]");
  const TaskNode filled = reader.fill(root, {{"n", "2"}, {"color_1", "red"}, {"color_2", "light blue"}});
  EXPECT_EQ(to_yaml(filled), "[\"light blue\", b1, {x: red}, b2, {x: \"light blue\"}]");
}

TEST(TaskTree, RefusesWhatItCanNotRead) {
  const auto complaint = [](const std::string& text) -> std::string {
    const TaskReader reader("t.yaml");
    try {
      reader.fill(reader.parse(text), {});
    } catch (const BadScript& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_EQ(complaint("a: [1, 2").rfind("t.yaml:1:", 0), 0u);
  EXPECT_EQ(complaint("a: 1\na: 2"), "t.yaml:2:1: 'a' is given twice");
  EXPECT_EQ(complaint("- \"{who}\""), "t.yaml:1:3: nothing is called {who} here (known: )");
  EXPECT_EQ(complaint("- a\n- \"b}\""), "t.yaml:2:3: '}' without '{'");
  EXPECT_NE(complaint("a: &x 1\nb: *x").find("aliases"), std::string::npos);
  EXPECT_NE(complaint(std::string(100, '[') + std::string(100, ']')).find("too deeply"), std::string::npos);
  EXPECT_NE(complaint("- {repeat: 1000000000, each: [x]}").find("whole number from 0 to 1000"),
            std::string::npos);
}

TEST(TaskRandom, IsTheSameEverywhere) {
  TaskRandom random("push_buttons", 3, 7);
  // Written down once; another number here means that every stored seed would show another scene.
  EXPECT_DOUBLE_EQ(random.uniform(0, 1), 0.079143264730455187);
  EXPECT_EQ(random.index(1000), 979u);
  TaskRandom other("push_buttons", 3, 8);
  EXPECT_NE(other.uniform(0, 1), TaskRandom("push_buttons", 3, 7).uniform(0, 1));
}

TEST(Footprints, MeasureTheGap) {
  EXPECT_NEAR(footprint_distance({{0, 0}, 0, .05, .05}, {{.2, 0}, 0, .05, .05}), 0.1, 1e-12);
  EXPECT_NEAR(footprint_distance({{0, 0}, 0, .05, .05}, {{.13, .14}, 0, .05, .05}), 0.05, 1e-12);
  EXPECT_NEAR(footprint_distance({{0, 0}, 0, .05, .05}, {{.2, 0}, EIGEN_PI / 4, .05, .05}),
              0.15 - .05 * std::sqrt(2.), 1e-9);
  EXPECT_EQ(footprint_distance({{0, 0}, 0, .05, .05}, {{.09, .02}, 1, .05, .05}), 0);
  EXPECT_EQ(footprint_distance({{0, 0}, 0, .5, .01}, {{0, 0}, EIGEN_PI / 2, .5, .01}), 0) << "a cross";
}

TEST(TaskLibrary, FindsTheTasksInOrderAndNamesThem) {
  const TaskLibrary library(kAssets);
  const std::vector<std::string> names = library.names();
  EXPECT_TRUE(std::ranges::is_sorted(names));
  for (const char* name : {"insert_onto_square_peg", "open_drawer", "push_buttons"})
    EXPECT_TRUE(std::ranges::binary_search(names, name)) << name;
  try {
    library.get("juggle");
    FAIL() << "an unknown task was accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("open_drawer"), std::string::npos);
  }
  EXPECT_THROW(TaskLibrary("/nowhere"), std::runtime_error);
}

TEST(Tasks, HaveTheBenchmarksVariationsAndWords) {
  const TaskLibrary library(kAssets);
  const auto buttons = library.get("push_buttons");
  ASSERT_EQ(buttons->variations(), 50);
  std::set<std::string> sentences;
  for (int i = 0; i < 50; ++i) {
    const auto phrasings = buttons->instructions(i);
    EXPECT_EQ(phrasings.size(), 3u);
    const std::string& first = phrasings.at(0);
    EXPECT_EQ(first.rfind("push the ", 0), 0u);
    std::size_t then = 0;
    for (auto at = first.find(", then push the "); at != std::string::npos;
         at = first.find(", then push the ", at + 1)) {
      ++then;
    }
    EXPECT_EQ(then, static_cast<std::size_t>(i % 3)) << first;
    sentences.insert(first);
  }
  EXPECT_EQ(sentences.size(), 50u) << "variations 3k, 3k+1 and 3k+2 share colours but not the number";
  EXPECT_EQ(buttons->instructions(1).at(0).rfind(buttons->instructions(0).at(0), 0), 0u)
      << "one colour triple";
  EXPECT_THROW(buttons->instructions(50), std::invalid_argument);

  const auto drawer = library.get("open_drawer");
  ASSERT_EQ(drawer->variations(), 3);
  EXPECT_EQ(drawer->instructions(0).at(0), "open the bottom drawer");
  EXPECT_EQ(drawer->instructions(2).at(0), "open the top drawer");

  const auto peg = library.get("insert_onto_square_peg");
  ASSERT_EQ(peg->variations(), 20);
  EXPECT_EQ(peg->instructions(0).at(0), "put the ring on the red spoke");
  EXPECT_EQ(peg->instructions(19).at(0), "put the ring on the white spoke");
}

class TaskFolder : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(testing::TempDir()) / ("tasks_of_a_user_" + std::to_string(::getpid())) /
              "poke";
    std::filesystem::create_directories(folder_);
    write("scene.xml",
          "<mujoco><include file='table.xml'/><include file='../../robots/panda.xml'/>"
          "<worldbody><body name='box' mocap='true'><geom type='box' size='.02 .02 .02'/>"
          "<body name='lid'><joint name='lid' type='slide'/><geom "
          "size='.01'/></body></body></worldbody></mujoco>");
  }
  void write(const std::string& name, const std::string& text) { std::ofstream(folder_ / name) << text; }
  /// The good file with one line replaced.
  std::string complaint(std::size_t line, const std::string& replacement) {
    auto lines = good_;
    lines.at(line - 1) = replacement;
    std::string text;
    for (const auto& each : lines) text += each + "\n";
    write("task.yaml", text);
    try {
      load_task(folder_, kAssets);
    } catch (const BadScript& error) {
      std::string what = error.what();
      const std::string file = (folder_ / "task.yaml").string() + ":";
      EXPECT_EQ(what.rfind(file, 0), 0u) << what;
      return what.substr(std::min(file.size(), what.size()));
    }
    return "accepted";
  }
  std::filesystem::path folder_;
  const std::vector<std::string> good_{
      "bounds: {min: [0, -0.4, 0.7], max: [0.5, 0.4, 1]}",                     // 1
      "keyframes: 2",                                                          // 2
      "variations: {combine: [{n: [1, 2]}]}",                                  // 3
      "instructions: [\"poke the box {n} times\"]",                            // 4
      "placement:",                                                            // 5
      "  root: {position: [0.25, 0, 0.752], yaw_deg: [-90, 90]}",              // 6
      "  objects: [{body: box, x: [-0.1, 0.1], footprint: [0.04, 0.04]}]",     // 7
      "success:",                                                              // 8
      "  joint: {joint: lid, beyond: 0.01}",                                   // 9
      "demonstration:",                                                        // 10
      "  - move: {frame: box, position: [0, 0, 0.1], rpy_deg: [180, 0, 0]}"};  // 11
};

TEST_F(TaskFolder, AUsersTaskNeedsNoCompiler) {
  ASSERT_EQ(complaint(2, "keyframes: 3"), "accepted");
  const TaskLibrary library(kAssets, {folder_.parent_path()});
  const auto task = library.get("poke");
  EXPECT_EQ(task->variations(), 2);
  EXPECT_EQ(task->keyframes(), 3);
  EXPECT_EQ(task->instructions(1).at(0), "poke the box 2 times");
}

TEST_F(TaskFolder, WaypointsMayBeKeptCloserThanTheBounds) {
  ASSERT_EQ(complaint(5,
                      "placement:\n"
                      "  waypoints: {min: [0.2, -0.4, 0.7], max: [0.3, 0.4, 1]}"),
            "accepted");
  const auto task = TaskLibrary(kAssets, {folder_.parent_path()}).get("poke");
  EXPECT_EQ(task->bounds().min.x(), 0);
  World world(task);
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    world.reset(0, seed);
    const double x = world.world_from("box").position.x();
    EXPECT_TRUE(x >= 0.203 && x <= 0.297) << "seed " << seed << ": " << x;
  }
}

TEST_F(TaskFolder, EveryMistakeIsNamedWithItsPlace) {
  EXPECT_EQ(complaint(1, "bounds: {min: [0, 0], max: [1, 1, 1]}"), "1:15: 'min' must be a list of 3 numbers");
  EXPECT_EQ(complaint(6, good_.at(5) + "\n  waypoints: {min: [0, 0, 1], max: [1, 1, 1]}"),
            "7:14: 'min' must be below 'max' on every axis");
  EXPECT_EQ(complaint(2, "keyframes: none"), "2:12: 'keyframes' needs a number here");
  EXPECT_EQ(complaint(2, "max_stops: 1").rfind("2:", 0), 0u);
  EXPECT_EQ(
      complaint(3, "variations: {combine: [{permutations: {from: [a, b], choose: 3, take: 1, as: x}}]}"),
      "3:62: 'choose' must be a whole number from 1 to 2");
  EXPECT_EQ(complaint(4, "instructions: [\"poke {m}\"]"), "4:16: nothing is called {m} here (known: n)");
  EXPECT_EQ(complaint(7, "  objects: [{body: bax}]"), "7:20: the scene has no body 'bax'");
  EXPECT_EQ(complaint(7, "  objects: [{body: lid}]").rfind("7:20: body 'lid' can not be placed", 0), 0u);
  EXPECT_EQ(complaint(7, "  objects: [{body: box, x: [1, 0]}]"), "7:28: 'x' runs from high to low");
  EXPECT_EQ(complaint(9, "  joint: {joint: lid}"), "9:10: 'beyond' is missing");
  EXPECT_EQ(
      complaint(11, "  - move: {frame: bax, position: [0, 0, 0], rpy_deg: [180, 0, 0]}").rfind("11:", 0), 0u);
  EXPECT_EQ(complaint(11, "  - jump: {frame: box}").rfind("11:", 0), 0u);
  EXPECT_EQ(complaint(11, "  - move: {frame: box, position: [0, 0], rpy_deg: [180, 0, 0]}").rfind("11:", 0),
            0u);
}

}  // namespace
}  // namespace flowscope
