#include "app/task_check.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/run_command.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

using nlohmann::json;
using testing::contains;
using testing::run_command;

TEST(TaskCheck, CountsWhatTheDemonstrationsReach) {
  const TaskLibrary library(find_assets());
  const TaskCheck check = check_task(library.get("open_drawer"), 4, 20);
  EXPECT_EQ(check.runs, 4);
  EXPECT_EQ(check.successes, 4);
  EXPECT_EQ(check.variations, 3);
  EXPECT_DOUBLE_EQ(check.keyframes, 3);
  EXPECT_EQ(check.keyframes_seen, 12);
  EXPECT_TRUE(check.outside.empty());
  EXPECT_EQ(check.published_keyframes, 3.0);
  EXPECT_EQ(check.done_at_start + check.done_early, 0);
  EXPECT_GT(check.sim_seconds, 4);
  EXPECT_TRUE(check.holds());
}

TEST(TaskCheck, AsksForNineteenOfTwentyAndForASuccessThatMeansSomething) {
  TaskCheck check;
  check.runs = 40, check.successes = 38;
  EXPECT_TRUE(check.holds());
  check.successes = 37;
  EXPECT_FALSE(check.holds());
  check.successes = 40, check.done_early = 2;
  EXPECT_TRUE(check.holds());
  check.done_early = 3;
  EXPECT_FALSE(check.holds());
  check.done_early = 0, check.done_at_start = 1;
  EXPECT_FALSE(check.holds());
  check.done_at_start = 0, check.keyframes = 4.2;
  EXPECT_TRUE(check.holds());
  check.published_keyframes = 3.6;
  EXPECT_FALSE(check.holds());
  check.published_keyframes = 3.7;
  EXPECT_TRUE(check.holds());
  check.outside.push_back({});
  EXPECT_FALSE(check.holds());
}

TEST(TaskCheck, AsksForNineteenOfTwentyOfEachVariationThatRanOftenEnough) {
  TaskCheck check;
  EXPECT_FALSE(check.weakest());
  check.runs = 80, check.successes = 78;
  check.by_variation = {{40, 40}, {40, 38}};
  EXPECT_EQ(check.weakest(), 1);
  EXPECT_TRUE(check.holds());
  check.by_variation = {{43, 41}, {37, 35}};
  EXPECT_FALSE(check.holds()) << "35 of 37 are fewer than 95 %";
  check.by_variation = {{61, 61}, {19, 17}};
  EXPECT_TRUE(check.holds()) << "too few runs to tell";
}

/// A folder with a copy of open_drawer in which `text` of its task.yaml is replaced.
class ChangedTask : public ::testing::Test {
 protected:
  void change(const std::string& text, const std::string& by) {
    const auto from = find_assets() / "tasks" / "open_drawer";
    std::filesystem::copy(from, folder_.path() / "changed");
    const auto file = folder_.path() / "changed" / "task.yaml";
    std::ifstream in(file);
    std::string yaml{std::istreambuf_iterator<char>(in), {}};
    const auto at = yaml.find(text);
    ASSERT_NE(at, std::string::npos);
    std::ofstream(file) << yaml.replace(at, text.size(), by);
  }
  json checked(int code) {
    const auto outcome = run_command({"tasks", "check", "changed", "--tasks", folder_.path().string(),
                                      "--episodes", "2", "--seed", "20", "--json"});
    EXPECT_EQ(outcome.code, code) << outcome.err;
    return json::parse(outcome.out).at("tasks").at(0);
  }
  testing::TemporaryFolder folder_;
};

TEST_F(ChangedTask, AConditionThatHoldsTooEarlyIsFound) {
  change("joint: {joint: \"drawer_{place}_slide\", beyond: 0.15}", "released: any");
  const json task = checked(1);
  EXPECT_EQ(task.at("done_at_start"), 2);
  EXPECT_FALSE(task.at("holds"));
}

TEST_F(ChangedTask, AFailureNamesVariationSeedAndReason) {
  change("beyond: 0.15", "beyond: 0.29");
  const json task = checked(1);
  EXPECT_EQ(task.at("successes"), 0);
  const json& failure = task.at("failures").at(1);
  EXPECT_EQ(failure.at("variation"), 1);
  EXPECT_EQ(failure.at("seed"), 21);
  EXPECT_TRUE(contains(failure.at("reason"), "drawer_middle_slide")) << failure.dump();
}

TEST_F(ChangedTask, AKeyframeOutsideTheBoundsIsNamed) {
  change("demonstration:\n",
         "demonstration:\n  - move: {frame: tool, position: [0, 0, 0.05], rpy_deg: [0, 0, 0]}\n");
  const json task = checked(1);
  EXPECT_EQ(task.at("successes"), 2);
  const json& outside = task.at("outside").at(0);
  EXPECT_EQ(outside.at("seed"), 20);
  EXPECT_TRUE(contains(outside.at("reason"), "mm outside the bounds")) << outside.dump();
}

TEST_F(ChangedTask, ItsDemonstrationsAreExportedWithItsFolderNamed) {
  change("beyond: 0.15", "beyond: 0.12");
  const std::string folder = folder_.path().string(), data = folder + "/data", file = folder + "/end.png";
  const auto recorded =
      run_command({"record", "changed", "--seed", "20", "--tasks", folder, "--data", data, "--json"});
  ASSERT_EQ(recorded.code, 0) << recorded.err;
  const std::string id = json::parse(recorded.out).at("demos").at(0);
  const std::vector<std::string> call{"export", "png", "--demo",  id,   "--data",   data,
                                      "--out",  file,  "--width", "64", "--height", "64"};
  EXPECT_NE(run_command(call).code, 0) << "nobody said where the task is";
  std::vector<std::string> with = call;
  with.insert(with.end(), {"--tasks", folder});
  const auto exported = run_command(with);
  EXPECT_EQ(exported.code, 0) << exported.err;
  EXPECT_GT(std::filesystem::file_size(file), 100u);
}

TEST(TasksCheckCommand, PrintsATableAndRefusesAnUnknownTask) {
  const auto table = run_command({"tasks", "check", "open_drawer", "--episodes", "1"});
  EXPECT_EQ(table.code, 0) << table.err;
  EXPECT_TRUE(contains(table.out, "| open_drawer | 3 | 1 of 1 | 1 of 1 | 3.0 | 3.0 | 0 of 3 |")) << table.out;
  const auto each = run_command({"tasks", "check", "open_drawer", "--per-variation", "2", "--json"});
  EXPECT_EQ(
      json::parse(each.out)["tasks"][0]["by_variation"],
      json::parse(
          R"([{"runs": 2, "successes": 2}, {"runs": 2, "successes": 2}, {"runs": 2, "successes": 2}])"));
  EXPECT_EQ(run_command({"tasks", "check", "--per-variation", "2", "--episodes", "2"}).code, 2);
  const auto unknown = run_command({"tasks", "check", "juggle"});
  EXPECT_EQ(unknown.code, 2);
  EXPECT_TRUE(contains(unknown.err, "open_drawer")) << unknown.err;
  EXPECT_TRUE(contains(run_command({"tasks"}).out, "open the bottom drawer")) << "the list is still there";
}

}  // namespace
}  // namespace flowscope
