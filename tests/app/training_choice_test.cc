// What is learnt from together: one robot, and what succeeds.
#include <gtest/gtest.h>

#include "app/policy_loop.h"
#include "app/training_set.h"
#include "tests/support/run_command.h"
#include "tests/support/synthetic_demo.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

using testing::contains;
using testing::run_command;

DemoInfo info_of(const std::string& task, const std::string& robot, std::optional<bool> success = true) {
  DemoInfo info;
  info.task = task;
  info.origin.robot = robot;
  info.success = success;
  return info;
}

TEST(TrainingChoice, UnfinishedOnesAreLeftOutUnlessAskedFor) {
  const std::vector<DemoInfo> stored{info_of("a", "panda"), info_of("a", "panda", false),
                                     info_of("a", "", std::nullopt), info_of("b", "panda", false)};
  const TrainingChoice choice = choose_training(stored, {"a"}, false);
  EXPECT_EQ(choice.demos.size(), 2u) << "of older files nobody knows, and they train";
  EXPECT_EQ(choice.unfinished, 1) << "b is not wanted anyway";
  EXPECT_EQ(choice.robot, "panda");
  EXPECT_EQ(choose_training(stored, {}, true).demos.size(), 4u);
}

TEST(TrainingChoice, SeveralRobotsAreNamedWithTheirTasks) {
  const std::vector<DemoInfo> stored{info_of("push", "panda"), info_of("fruit", "ur5"),
                                     info_of("chess", "ur5"), info_of("saw", "jaw", false)};
  try {
    choose_training(stored, {}, false);
    FAIL() << "was let through";
  } catch (const std::invalid_argument& error) {
    EXPECT_TRUE(contains(error.what(), "panda (push) ur5 (chess, fruit)")) << error.what();
    EXPECT_FALSE(contains(error.what(), "jaw")) << "it would not be learnt from";
  }
  EXPECT_EQ(choose_training(stored, {"fruit", "chess"}, false).robot, "ur5");
}

/// A store with a Panda's and a UR5's demonstration.
class Mixed : public ::testing::Test {
 protected:
  void SetUp() override {
    Demo demo = testing::toy_push_buttons(1);
    demo.info.origin = {"panda", 7, {}};
    store_.save(demo);
    demo = testing::toy_push_buttons(2);
    demo.info.task = "put_fruit_in_bowl";
    demo.info.origin = {"ur5", 6, {}};
    ur5_ = store_.save(demo);
  }
  web::TrainRequest request(const std::string& task) const {
    web::TrainRequest request;
    request.start = true;
    request.options.preset = "nano";
    request.steps = 1;
    if (!task.empty()) request.tasks = {task};
    return request;
  }
  const testing::TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_.path() / "p.flow";
  const DemoStore store_{folder_.path()};
  std::string ur5_;
};

TEST_F(Mixed, TrainPredictAndResumeRefuseAnotherRobot) {
  const std::string data = folder_.path().string(), policy = file_.string();
  const auto train = [&](std::vector<std::string> more) {
    more.insert(more.begin(),
                {"train", "--data", data, "--policy", policy, "--preset", "nano", "--steps", "1"});
    return run_command(more);
  };
  auto outcome = train({});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_TRUE(contains(outcome.err, "--tasks: a policy learns one robot")) << outcome.err;
  EXPECT_TRUE(contains(outcome.err, "panda (push_buttons) ur5 (put_fruit_in_bowl)")) << outcome.err;
  EXPECT_EQ(train({"--tasks", "push_buttons"}).code, 0);
  outcome = train({"--tasks", "put_fruit_in_bowl", "--resume"});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_TRUE(contains(outcome.err, "has learnt the robot panda, and this is ur5")) << outcome.err;
  outcome = run_command({"predict", "--policy", policy, "--data", data, "--demo", ur5_, "--keyframe", "0",
                         "--trace", data + "/t.json"});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_TRUE(contains(outcome.err, "has learnt the robot panda, and this is ur5")) << outcome.err;
}

TEST_F(Mixed, TheProgramThatServesRefusesThemToo) {
  PolicyLoop loop(store_, file_, [](const web::TrainReport&) {});
  try {
    loop.start(request("")).get();
    FAIL() << "was let through";
  } catch (const web::ApiError& error) {
    EXPECT_EQ(error.code, "several_robots");
  }
  loop.start(request("push_buttons")).get();
  while (loop.report().running) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  EXPECT_EQ(loop.report().error, "");
  web::TrainRequest other = request("put_fruit_in_bowl");
  other.resume = true;
  EXPECT_THROW(loop.start(other).get(), web::ApiError);
}

}  // namespace
}  // namespace flowscope
