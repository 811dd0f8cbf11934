// The paper's crops: picture and places stay together, and no place is invented.
#include "policy/picture_crop.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <set>

#include "policy/sample.h"
#include "tests/support/synthetic_demo.h"

namespace flowscope {
namespace {

TEST(PictureCrop, TheWholePictureAtScaleOneIsItself) {
  const std::vector<int> source = source_pixels(5, 4, {});
  for (int i = 0; i < 20; ++i) EXPECT_EQ(source[static_cast<std::size_t>(i)], i);
}

TEST(PictureCrop, MirrorsAboutTheEdgePixelOfAReducedPicture) {
  // Four pixels become three, which show pixels 0, 2 and 3; the window begins one to their left.
  EXPECT_EQ(source_pixels(4, 1, {0.75, -1, 0}), (std::vector<int>{2, 0, 2, 3}));
  EXPECT_EQ(source_pixels(4, 1, {0.75, 0, 0}), (std::vector<int>{0, 2, 3, 2}));
}

TEST(PictureCrop, ShowsAPartOfAnEnlargedPicture) {
  // Four pixels become five: 0 0 1 2 3 … by nearest centres.
  EXPECT_EQ(source_pixels(4, 1, {1.25, 1, 0}), (std::vector<int>{1, 2, 2, 3}));
}

TEST(PictureCrop, RandomCropsStayWithinThePicture) {
  Random random(3);
  double smallest = 2, largest = 0;
  bool moved = false;
  for (int i = 0; i < 500; ++i) {
    const PictureCrop crop = random_crop(128, 96, random);
    smallest = std::min(smallest, crop.scale);
    largest = std::max(largest, crop.scale);
    const double width = std::lround(128 * crop.scale), height = std::lround(96 * crop.scale);
    EXPECT_LE(std::max(0.0, width - 128), 32);
    EXPECT_GE(crop.left, std::min(0.0, width - 128));
    EXPECT_LE(crop.left, std::max(0.0, width - 128));
    EXPECT_GE(crop.top, std::min(0.0, height - 96));
    EXPECT_LE(crop.top, std::max(0.0, height - 96));
    moved = moved || (crop.left != 0 && crop.top != 0);
  }
  EXPECT_GE(smallest, 0.75);
  EXPECT_LT(smallest, 0.77);
  EXPECT_LE(largest, 1.25);
  EXPECT_GT(largest, 1.23);
  EXPECT_TRUE(moved);
}

TEST(PictureCrop, ColourDepthAndPlaceOfAPixelStayTogether) {
  const Observation whole = testing::toy_push_buttons(3).start;
  const PictureCrop crop{1.2, 7, 11};
  const ResampledObservation seen = resample(whole, crop);
  const std::vector<int> source = source_pixels(128, 128, crop);
  ASSERT_EQ(seen.world.size(), whole.views.size());
  for (std::size_t v = 0; v < whole.views.size(); ++v)
    for (const std::size_t i : {0u, 131u, 9000u, 16383u}) {
      const int x = source[i] % 128, y = source[i] / 128;
      const View& from = whole.views[v];
      EXPECT_EQ(seen.observation.views[v].rgb.data[3 * i + 1], from.rgb.at(x, y)[1]);
      EXPECT_EQ(seen.observation.views[v].depth.data[i], from.depth.at(x, y));
      if (from.depth.at(x, y) == 0) continue;
      EXPECT_EQ(seen.world[v][i], from.camera.unproject(x + 0.5, y + 0.5, from.depth.at(x, y)));
    }
}

TEST(PictureCrop, RefusesViewsOfDifferentSizes) {
  Observation observation = testing::toy_push_buttons(3).start;
  observation.views[1].rgb.data.pop_back();
  EXPECT_THROW(resample(observation, {}), std::invalid_argument);
}

struct Prepared {
  Demo demo = testing::toy_push_buttons(3);
  NetworkShape shape = load_preset("nano").shape;
  Vocabulary vocabulary;
  std::vector<Sample> samples = samples_of(demo, demo.bounds, shape, vocabulary, true);
};

TEST(PictureCrop, ACroppedSceneHasOnlyMeasuredPoints) {
  const Prepared p;
  const PointCloud cloud = to_point_cloud(p.demo.start, workspace_of(p.demo.bounds));
  std::set<std::array<float, 3>> measured;
  for (const auto& q : cloud.position) measured.insert({q.x(), q.y(), q.z()});
  Random random(5);
  int changed = 0;
  for (int i = 0; i < 8; ++i) {
    const Sample cropped = with_cropped_pictures(p.samples.front(), p.demo.bounds, p.shape, random);
    for (const ScenePoint& point : cropped.input.scene->points)
      ASSERT_TRUE(measured.contains({point.position.x(), point.position.y(), point.position.z()})) << i;
    changed += cropped.input.scene->patches != p.samples.front().input.scene->patches;
    EXPECT_EQ(cropped.target, p.samples.front().target);
  }
  EXPECT_EQ(changed, 8);
}

TEST(PictureCrop, ASampleWithoutItsObservationIsRefused) {
  const Prepared p;
  Sample bare = p.samples.front();
  bare.observation = nullptr;
  Random random(5);
  EXPECT_THROW(with_cropped_pictures(bare, p.demo.bounds, p.shape, random), std::invalid_argument);
}

TEST(Augmentation, EveryKindDoesItsOwnAndNoOther) {
  const Prepared p;
  const TrainRates rates = load_preset("nano").rates;
  const Sample& before = p.samples.front();
  const auto any_of = [&](const Augmentation& kinds, const auto& differs) {
    Random random(1);
    for (int i = 0; i < 12; ++i)
      if (differs(augment(before, rates, {0.2, 0, 0.8}, random, kinds))) return true;
    return false;
  };
  const auto same_pose = [](const Pose& a, const Pose& b) {
    return position_error_m(a, b) < 1e-6 && rotation_error_rad(a, b) < 1e-6;
  };
  const auto moved = [&](const Sample& s) {  // the tool goes along with the whole scene
    return !same_pose(s.input.history.back().world_from_tool, before.input.history.back().world_from_tool);
  };
  std::set<std::array<float, 3>> colors;
  for (const ScenePoint& point : before.input.scene->points)
    colors.insert({point.color.x(), point.color.y(), point.color.z()});
  const auto recolored = [&](const Sample& s) {
    return std::ranges::any_of(s.input.scene->points, [&](const ScenePoint& point) {
      return !colors.contains({point.color.x(), point.color.y(), point.color.z()});
    });
  };
  const auto shuffled = [&](const Sample& s) {
    return !moved(s) && !same_pose(s.target.world_from_tool, before.target.world_from_tool);
  };
  const Augmentation none = Augmentation::none();
  Augmentation move = none, recolor = none, repaint = none, shuffle = none;
  move.move = recolor.recolor = repaint.repaint = shuffle.shuffle = true;
  EXPECT_TRUE(any_of(move, moved) && !any_of(move, recolored));
  EXPECT_TRUE(any_of(recolor, recolored) && !any_of(recolor, moved) && !any_of(recolor, shuffled));
  EXPECT_TRUE(any_of(repaint, recolored) && !any_of(repaint, moved) && !any_of(repaint, shuffled));
  EXPECT_TRUE(any_of(shuffle, shuffled) && !any_of(shuffle, moved) && !any_of(shuffle, recolored));
  Random random(1);
  EXPECT_EQ(augment(before, rates, {0.2, 0, 0.8}, random, none).input.scene, before.input.scene);
}

TEST(Augmentation, IsNamed) {
  EXPECT_EQ(augmentation_of("default"), Augmentation{});
  EXPECT_EQ(augmentation_of("none"), Augmentation::none());
  EXPECT_EQ(augmentation_of("crop,move"),
            (Augmentation{.move = true, .recolor = false, .shuffle = false, .crop = true, .repaint = false}));
  for (const char* names : {"none", "move,recolor,repaint,shuffle,crop", "recolor"})
    EXPECT_EQ(names_of(augmentation_of(names)), names);
  for (const char* names : {"", "moves", "move,,crop", "move recolor"})
    EXPECT_THROW(augmentation_of(names), std::invalid_argument) << names;
}

}  // namespace
}  // namespace flowscope
