// What is drawn from several tasks, and when.
#include "policy/training_set.h"

#include <gtest/gtest.h>

#include "tests/support/synthetic_demo.h"
#include "tests/support/toy_scenes.h"

namespace flowscope {
namespace {

class TrainingSets : public ::testing::Test {
 protected:
  /// How often each demonstration is drawn.
  std::map<std::string, int> draws(int count) {
    Random random(1);
    std::map<std::string, int> drawn;
    for (int i = 0; i < count; ++i) ++drawn[data_.draw(random).demo];
    return drawn;
  }
  Model model_ = make_model(testing::toy_shape(), RadiusSchedule{}, "mamba", "cfm", 1);
  TrainingSet data_;
};

TEST_F(TrainingSets, DrawsEveryTaskAsOften) {
  for (const std::uint64_t seed : {1, 2, 3}) data_.add(model_, testing::toy_push_buttons(seed), false);
  data_.add(model_, testing::toy_open_drawer(1), false);
  data_.freeze(model_);
  const auto drawn = draws(4000);
  ASSERT_EQ(drawn.size(), 4u);
  EXPECT_NEAR(drawn.at("open_drawer-1"), 2000, 150);
}

TEST_F(TrainingSets, ATaskWhoseDemonstrationsAreAllHeldOutIsNotDrawn) {
  data_.add(model_, testing::toy_push_buttons(1), false);
  data_.add(model_, testing::toy_open_drawer(1), true);
  data_.freeze(model_);
  EXPECT_EQ(draws(50).size(), 1u);
  EXPECT_EQ(data_.held_out().size(), 1u);
  EXPECT_EQ(data_.held_out().at("open_drawer").size(), 3u);
}

TEST_F(TrainingSets, WhatArrivesIsDrawnAtOnceAndWhatLeavesNoMore) {
  data_.add(model_, testing::toy_push_buttons(1), false);
  data_.freeze(model_);
  data_.add(model_, testing::toy_open_drawer(1), false);
  EXPECT_GT(draws(100)["open_drawer-1"], 20);
  data_.remove("push_buttons-1");
  EXPECT_EQ(draws(100)["open_drawer-1"], 100);
  data_.remove("open_drawer-1");
  EXPECT_THROW(draws(1), std::invalid_argument);
}

TEST_F(TrainingSets, TheirFingerprintTellsThemApart) {
  data_.add(model_, testing::toy_push_buttons(1), false);
  const std::string one = data_.fingerprint();
  data_.add(model_, testing::toy_push_buttons(2), false);
  const std::string two = data_.fingerprint();
  EXPECT_NE(one, two);
  data_.add(model_, testing::toy_push_buttons(2), true);
  EXPECT_NE(data_.fingerprint(), two);
  data_.remove("push_buttons-2");
  EXPECT_EQ(data_.fingerprint(), one);
}

}  // namespace
}  // namespace flowscope
