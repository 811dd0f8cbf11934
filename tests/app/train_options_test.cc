// What the train command refuses before it has read a demonstration's pictures, and what it tells at the end.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "recorder/demo_store.h"
#include "tests/support/run_command.h"
#include "tests/support/synthetic_demo.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

using testing::contains;
using testing::Outcome;

class TrainOptionsOfTheCommand : public ::testing::Test {
 protected:
  TrainOptionsOfTheCommand() {
    store_.save(testing::toy_push_buttons(3));
    store_.save(testing::toy_open_drawer(1));
  }
  Outcome train(const std::vector<std::string>& more) const {
    std::vector<std::string> words{
        "train", "--data", folder_.path().string(), "--policy", policy_, "--preset", "nano", "--scenes", "1"};
    words.insert(words.end(), more.begin(), more.end());
    return testing::run_command(words);
  }
  const testing::TemporaryFolder folder_;
  const DemoStore store_{folder_.path()};
  const std::string policy_ = (folder_.path() / "a.fsp").string();
};

TEST_F(TrainOptionsOfTheCommand, WhatIsWrongIsNamed) {
  const std::vector<std::pair<std::vector<std::string>, std::string>> calls = {
      {{"--steps", "1", "--augment", "moves"}, "moves"},
      {{"--steps", "1", "--augment", "move", "--no-augment"}, "--no-augment"},
      {{"--steps", "1", "--binding", "maybe"}, "--binding"},
      {{"--steps", "1", "--times", "late"}, "late"},
      {{"--steps", "1", "--device", "tpu"}, "tpu"},
      {{"--steps", "1", "--scenes", "0"}, "--scenes"}};
  for (const auto& [call, name] : calls) {
    const Outcome outcome = train(call);
    EXPECT_EQ(outcome.code, 2) << name << ": " << outcome.err;
    EXPECT_TRUE(contains(outcome.err, name)) << outcome.err;
  }
  EXPECT_FALSE(std::filesystem::exists(policy_));
}

TEST_F(TrainOptionsOfTheCommand, MiddlesOfPartsReachThePolicyAndStayWithIt) {
  const auto kept = [&](const std::vector<std::string>& more) {
    const Outcome trained = train(more);
    EXPECT_EQ(trained.code, 0) << trained.err;
    const Outcome shown = testing::run_command({"policy", "show", policy_, "--json"});
    return nlohmann::json::parse(shown.out).at("shape").at("part_middles").get<bool>();
  };
  EXPECT_FALSE(kept({"--steps", "1", "--part-middles", "off"}));
  EXPECT_FALSE(kept({"--steps", "2", "--resume"})) << "a policy keeps what it was made with";
  std::filesystem::remove(policy_);
  EXPECT_TRUE(kept({"--steps", "1"}));
}

TEST_F(TrainOptionsOfTheCommand, TheResultTellsTheLossByPart) {
  const Outcome outcome =
      train({"--steps", "2", "--augment", "crop,move", "--times", "uniform", "--binding", "off", "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto result = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(result["steps"], 2);
  EXPECT_EQ(result["processes"], 1);
  EXPECT_EQ(result["skipped"], 0);
  for (const char* key : {"loss", "loss_position", "loss_rotation", "loss_open"})
    EXPECT_GT(result[key].get<double>(), 0) << key;
  EXPECT_TRUE(result["validation"]["tasks"].is_array());
}

}  // namespace
}  // namespace flowscope
