// Changes of colour: what they keep, and what they take away.
#include "policy/recolor.h"

#include <gtest/gtest.h>

#include <set>

#include "recorder/colors.h"

namespace flowscope {
namespace {

using Eigen::Vector3f;

// Three pillars 8 cm apart, each in one colour with a lit and a darker half, and a grey post.
struct Pillars {
  PreparedScene scene;
  std::vector<Word> words;

  explicit Pillars(const std::vector<Vector3f>& colors) {
    std::vector<Vector3f> position, color;
    for (std::size_t k = 0; k < colors.size(); ++k)
      for (int i = 0; i < 12; ++i) {
        position.emplace_back(0.08f * static_cast<float>(k), 0.f, 0.01f * static_cast<float>(i));
        color.push_back(colors[k] * (i % 2 ? 0.8f : 0.6f));
      }
    const std::vector<char> skip(position.size());
    scene.part = find_parts(position, color, skip);
    for (std::size_t i = 0; i < position.size(); ++i)
      scene.points.push_back({position[i], color[i], Vector3f::Zero(), {}});
  }
  Vector3f color_of(int pillar) const {
    return scene.points[static_cast<std::size_t>(12 * pillar + 1)].color;
  }
};

Word color_word(const Vector3f& rgb, int mention = 1) { return {Vocabulary::color, mention, rgb}; }

const Vector3f red(1, 0, 0), blue(0, 0, 1), lime(0, 1, 0), gray(.5f, .5f, .5f);

Vector3f hue(const Vector3f& rgb) { return (rgb.array() - rgb.mean()).matrix().normalized(); }

TEST(Parts, HangTogetherByPlaceAndColour) {
  const Pillars p({red, blue, red});
  std::set<int> ids;
  for (int k = 0; k < 3; ++k) {
    ids.insert(p.scene.part[static_cast<std::size_t>(12 * k)]);
    for (int i = 0; i < 12; ++i)
      EXPECT_EQ(p.scene.part[static_cast<std::size_t>(12 * k + i)],
                p.scene.part[static_cast<std::size_t>(12 * k)]);
  }
  EXPECT_EQ(ids.size(), 3u);
  EXPECT_EQ(ids.count(-1), 0u);
}

TEST(Repaint, KeepsThatTheNamedPartHasTheWordsColourAndNoOtherPart) {
  Random random(3);
  std::set<int> targets;
  for (int round = 0; round < 50; ++round) {
    Pillars p({red, blue, lime, gray});
    p.words = {Word{}, color_word(blue)};
    ASSERT_TRUE(repaint_parts(p.scene, p.words, random));
    const Vector3f word = p.words[1].color;
    EXPECT_LT((hue(p.color_of(1)) - hue(word)).norm(), 1e-3f);
    EXPECT_GT((hue(p.color_of(0)) - hue(word)).norm() + (p.color_of(0) - p.color_of(1)).norm(), 0.05f);
    EXPECT_GT((hue(p.color_of(2)) - hue(word)).norm() + (p.color_of(2) - p.color_of(1)).norm(), 0.05f);
    EXPECT_EQ(p.color_of(3), gray * 0.8f);
    // The shading of the part stays: its darker half is darker by the same factor.
    EXPECT_NEAR(p.scene.points[12].color.mean() / p.color_of(1).mean(), 0.75f, 0.05f);
    targets.insert(static_cast<int>(100 * word.x() + 10 * word.y() + word.z() * 4));
  }
  EXPECT_GT(targets.size(), 8u);
}

TEST(Repaint, GivesAWordThatComesTwiceOneColourAndTwoWordsTwo) {
  Random random(5);
  Pillars p({red, blue, lime});
  p.words = {color_word(red, 1), color_word(blue, 2), color_word(red, 3)};
  ASSERT_TRUE(repaint_parts(p.scene, p.words, random));
  EXPECT_EQ(p.words[0].color, p.words[2].color);
  EXPECT_NE(p.words[0].color, p.words[1].color);
}

TEST(Repaint, LeavesASceneAloneWhoseWordNamesAGreyOrNothingInView) {
  Random random(5);
  for (const Vector3f& named : {gray, lime}) {
    Pillars p({red, blue});
    const Pillars before({red, blue});
    p.words = {color_word(named)};
    EXPECT_FALSE(repaint_parts(p.scene, p.words, random));
    EXPECT_EQ(p.words[0].color, named);
    EXPECT_EQ(p.color_of(0), before.color_of(0));
  }
}

TEST(TurnColors, KeepsEveryDistanceBetweenColours) {
  Random random(8);
  Pillars p({red, blue, lime});
  p.words = {color_word(red)};
  const float before = (p.color_of(0) - p.color_of(1)).norm(), to_word = (p.color_of(2) - red).norm();
  turn_colors(p.scene, p.words, random);
  EXPECT_NEAR((p.color_of(0) - p.color_of(1)).norm(), before, 1e-5);
  EXPECT_NEAR((p.color_of(2) - p.words[0].color).norm(), to_word, 1e-5);
}

}  // namespace
}  // namespace flowscope
