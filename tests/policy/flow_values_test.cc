// The small maths of a prediction: radius, rotation, normalisation, words, noise.
#include <gtest/gtest.h>

#include <numbers>
#include <stdexcept>

#include "policy/random.h"
#include "policy/rotation6.h"
#include "policy/words.h"

namespace flowscope {
namespace {

TEST(RadiusSchedule, FallsFromFirstToLastRadius) {
  for (const char* kind : {"linear", "cosine"}) {
    const RadiusSchedule schedule{kind, 0.5, 0.1};
    EXPECT_DOUBLE_EQ(schedule.radius_m(0), 0.5) << kind;
    EXPECT_NEAR(schedule.radius_m(1), 0.1, 1e-15) << kind;
    EXPECT_NEAR(schedule.radius_m(0.5), 0.3, 1e-15) << kind;
    for (int i = 1; i <= 20; ++i)
      EXPECT_LT(schedule.radius_m(i / 20.0), schedule.radius_m((i - 1) / 20.0)) << kind;
  }
  EXPECT_NEAR((RadiusSchedule{"linear", 0.5, 0.1}.radius_m(0.25)), 0.4, 1e-15);
  EXPECT_GT((RadiusSchedule{"cosine", 0.5, 0.1}.radius_m(0.25)), 0.43);
  EXPECT_THROW((RadiusSchedule{"square", 0.5, 0.1}.radius_m(0)), std::invalid_argument);
}

TEST(Rotation6, HoldsTheFirstTwoColumns) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitZ()));
  const auto six = rotation_to_6d(turn);  // x -> y, y -> -x: rows would give the transpose
  const double expected[] = {0, 1, 0, -1, 0, 0};
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(six[i], expected[i], 1e-15);
}

TEST(Rotation6, ReturnsEveryRotationAndAcceptsAnyNumbers) {
  Random random(3);
  for (int i = 0; i < 200; ++i) {
    Eigen::Matrix<double, 6, 1> six;
    for (double& v : six) v = random.normal();
    const Eigen::Quaterniond rotation = rotation_from_6d(six);
    EXPECT_NEAR(rotation.norm(), 1, 1e-12);
    EXPECT_LT(rotation.angularDistance(rotation_from_6d(rotation_to_6d(rotation))), 1e-7);
  }
  EXPECT_NEAR(rotation_from_6d(Eigen::Matrix<double, 6, 1>::Zero()).norm(), 1, 1e-12);
}

TEST(PositionScale, MapsTheWidenedBoxToPlusMinusOne) {
  const auto scale = PositionScale::from_bounds({{0.1, -0.3, 0.8}, {0.5, 0.3, 0.9}});
  EXPECT_TRUE(scale.normalise({0.54, 0.34, 0.94}).isApprox(Eigen::Vector3d::Ones(), 1e-12));
  EXPECT_TRUE(scale.denormalise({-1, -1, -1}).isApprox(Eigen::Vector3d(0.06, -0.34, 0.76), 1e-12));
}

TEST(Words, ColoursCarryTheirValueAndOrder) {
  Vocabulary vocabulary;
  vocabulary.learn("Push the red button, then push the blue button");
  const auto words = vocabulary.encode("push the BLUE button, then the red thing", 24);
  ASSERT_EQ(words.size(), 8u);
  EXPECT_EQ(words[2].row, Vocabulary::color);
  EXPECT_EQ(words[2].mention, 1);
  EXPECT_EQ(words[2].color, Eigen::Vector3f(0, 0, 1));
  EXPECT_EQ(words[6].mention, 2);
  EXPECT_EQ(words[7].row, Vocabulary::unknown);
  EXPECT_NE(words[0].row, words[1].row);
  EXPECT_THROW(vocabulary.encode(" ,. ", 24), std::invalid_argument);
}

TEST(Noise, IsTheSameInEveryProgram) {
  Random random(7);
  EXPECT_EQ(random.bits(), 7191089600892374487ull);  // SplitMix64 of seed 7
  double sum = 0, squares = 0;
  for (int i = 0; i < 20000; ++i) {
    const double v = random.normal();
    sum += v, squares += v * v;
  }
  EXPECT_NEAR(sum / 20000, 0, 0.03);
  EXPECT_NEAR(squares / 20000, 1, 0.04);
}

}  // namespace
}  // namespace flowscope
