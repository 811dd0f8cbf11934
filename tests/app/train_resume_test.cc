// Going on with a policy, damaged demonstrations, and what is said when nothing is held out.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "app/policy_loop.h"
#include "recorder/demo_file.h"
#include "tests/support/run_command.h"
#include "tests/support/synthetic_demo.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

using nlohmann::json;
using testing::contains;
using testing::Outcome;

class TrainResume : public ::testing::Test {
 protected:
  TrainResume() { good_ = store_.save(testing::toy_push_buttons(3)); }
  Outcome train(const std::vector<std::string>& more) const {
    std::vector<std::string> words{
        "train", "--data", folder_.path().string(), "--policy", policy_, "--preset", "nano", "--scenes", "1"};
    words.insert(words.end(), more.begin(), more.end());
    return testing::run_command(words);
  }
  void write(const std::string& id, const Bytes& bytes) const {
    std::ofstream(store_.path(id), std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
  /// One that is cut short, one without a header, one of one frame, and one that is there already.
  void add_damaged() const {
    Bytes bytes = encode_demo(testing::toy_push_buttons(4));
    bytes.resize(bytes.size() - 1000);
    write("cut", bytes);
    write("torn", {'F', 'L', 'O', 'W'});
    Demo standing = testing::toy_push_buttons(5);
    standing.frames.resize(1);
    standing.keyframes.clear();
    write("standing", encode_demo(standing));
    write("x-twin", encode_demo(testing::toy_push_buttons(3)));
  }
  web::TrainReport train_to_the_end(PolicyLoop& loop, bool resume = false) const {
    web::TrainRequest request;
    request.start = true;
    request.resume = resume;
    request.options.preset = "nano";
    request.options.scenes = 1;
    request.steps = 2;
    loop.start(request).get();
    while (loop.report().running) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    return loop.report();
  }

  const testing::TemporaryFolder folder_;
  const DemoStore store_{folder_.path()};
  const std::string policy_ = (folder_.path() / "a.flow").string();
  std::string good_;
};

TEST_F(TrainResume, MinutesAndStepsCountFromNowOn) {
  const Outcome first = train({"--minutes", "0.02", "--json"});
  ASSERT_EQ(first.code, 0) << first.err;
  const json before = json::parse(first.out);
  const Outcome second = train({"--minutes", "0.01", "--resume", "--json"});
  ASSERT_EQ(second.code, 0) << second.err;
  const json after = json::parse(second.out);
  EXPECT_GE(after.at("minutes").get<double>(), before.at("minutes").get<double>() + 0.01)
      << "fewer minutes than it had behind it ended it after one step";
  EXPECT_TRUE(
      contains(second.err, "going on after " + std::to_string(before.at("steps").get<int>()) + " steps"))
      << second.err;
  const json third = json::parse(train({"--steps", "3", "--resume", "--json"}).out);
  EXPECT_EQ(third.at("steps").get<int>(), after.at("steps").get<int>() + 3);
}

TEST_F(TrainResume, NothingHeldOutIsNoErrorOfZero) {
  const json report = json::parse(train({"--steps", "1", "--json"}).out);
  const json& validation = report.at("validation");
  EXPECT_TRUE(validation.at("position_mm").is_null());
  EXPECT_TRUE(validation.at("rotation_deg").is_null());
  EXPECT_EQ(validation.at("keyframes"), 0);
  const Outcome told = train({"--steps", "1"});
  EXPECT_TRUE(contains(told.out, "no held-out error")) << told.out;
  EXPECT_FALSE(contains(told.out, "0.0 mm")) << told.out;
}

TEST_F(TrainResume, DamagedDemonstrationsAreLeftOutWithAWarning) {
  add_damaged();
  const Outcome outcome = train({"--steps", "1", "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_TRUE(contains(outcome.err, "training on 1 demonstrations")) << outcome.err;
  const json left_out = json::parse(outcome.out).at("left_out");
  EXPECT_EQ(left_out.size(), 4u);
  for (const json& one : left_out) {
    const std::string problem = one.at("problem");
    EXPECT_TRUE(contains(problem, store_.path(one.at("id")).string())) << problem;
    EXPECT_TRUE(contains(outcome.err, "warning: left out: " + problem)) << outcome.err;
  }
  store_.remove(good_);
  std::filesystem::remove(store_.path("x-twin"));
  const Outcome none = train({"--steps", "1"});
  EXPECT_EQ(none.code, 2);
  EXPECT_TRUE(contains(none.err, "no demonstrations to learn from; left out: ")) << none.err;
}

TEST_F(TrainResume, TheProgramThatServesLeavesThemOutToo) {
  add_damaged();
  PolicyLoop loop(store_, policy_, [](const web::TrainReport&) {});
  const web::TrainReport report = train_to_the_end(loop);
  EXPECT_EQ(report.error, "");
  EXPECT_EQ(report.status.demos, 1);
  EXPECT_EQ(report.left_out.size(), 4u);
  EXPECT_EQ(train_to_the_end(loop, true).left_out.size(), 4u) << "told once each, also when it goes on";
  EXPECT_EQ(loop.status().file, policy_);
  store_.remove(good_);
  std::filesystem::remove(store_.path("x-twin"));
  try {
    train_to_the_end(loop);
    FAIL() << "learnt from nothing";
  } catch (const web::ApiError& error) {
    EXPECT_EQ(error.status, 409);
    EXPECT_TRUE(contains(error.what(), "left") || contains(error.what(), "learnt from")) << error.what();
  }
  EXPECT_TRUE(loop.status().loaded) << "what was trained before is not lost";
}

TEST_F(TrainResume, AFileThatCouldNotBeSavedIsNotNamed) {
  std::ofstream(folder_.path() / "no_folder") << "x";
  PolicyLoop loop(store_, folder_.path() / "no_folder" / "live.flow", [](const web::TrainReport&) {});
  const web::TrainReport report = train_to_the_end(loop);
  EXPECT_TRUE(contains(report.error, "live.flow")) << report.error;
  EXPECT_TRUE(loop.status().loaded) << "it predicts all the same";
  EXPECT_EQ(loop.status().file, "");
  EXPECT_EQ(loop.status().generation, 2u);
  try {
    train_to_the_end(loop, true);
    FAIL() << "went on without the weights";
  } catch (const web::ApiError& error) {
    EXPECT_EQ(error.status, 507);
  }
}

}  // namespace
}  // namespace flowscope
