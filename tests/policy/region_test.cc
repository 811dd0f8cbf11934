// What the perception sphere lets through.
#include "policy/region.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "policy/random.h"
#include "policy/sample.h"
#include "tests/support/synthetic_demo.h"

namespace flowscope {
namespace {

std::vector<ScenePoint> cloud(int count) {
  Random random(5);
  std::vector<ScenePoint> points;
  for (int i = 0; i < count; ++i) {
    ScenePoint p{Eigen::Vector3f::Zero(), Eigen::Vector3f::Zero(), Eigen::Vector3f::Zero(), {}};
    for (int a = 0; a < 3; ++a) p.position[a] = static_cast<float>(random.uniform(-0.5, 0.5));
    points.push_back(p);
  }
  return points;
}

TEST(Region, TakesOnlyPointsInsideWhenThereAreEnough) {
  const auto points = cloud(2000);
  const Eigen::Vector3f center(0.1f, 0, -0.1f);
  const RegionPoints region = select_region(points, center, 0.3f, 64);
  int inside = 0;
  for (const auto& p : points) inside += (p.position - center).norm() <= 0.3f;
  EXPECT_EQ(region.points_inside, inside);
  ASSERT_EQ(region.index.size(), 64u);
  for (const int i : region.index)
    EXPECT_LE((points[static_cast<std::size_t>(i)].position - center).norm(), 0.3f);
}

TEST(Region, TakesFarthestPointsOfAllInsideByThatRule) {
  const auto points = cloud(3000);
  const Eigen::Vector3f center(0.1f, 0, -0.1f);
  const RegionPoints region = select_region(points, center, 0.3f, 64, false, SphereRule::farthest);
  std::vector<int> inside;
  for (int i = 0; i < 3000; ++i)
    if ((points[static_cast<std::size_t>(i)].position - center).norm() <= 0.3f) inside.push_back(i);
  EXPECT_EQ(region.points_inside, static_cast<int>(inside.size()));
  const auto gap2 = [&](int i, const std::vector<int>& to) {
    float nearest = 1e9f;
    for (const int j : to)
      nearest = std::min(nearest, (points[static_cast<std::size_t>(i)].position -
                                   points[static_cast<std::size_t>(j)].position)
                                      .squaredNorm());
    return nearest;
  };
  std::vector<int> expected{inside.front()};
  while (expected.size() < 64)
    expected.push_back(*std::max_element(
        inside.begin(), inside.end(), [&](int a, int b) { return gap2(a, expected) < gap2(b, expected); }));
  std::vector<int> taken = region.index;
  std::sort(taken.begin(), taken.end());
  std::sort(expected.begin(), expected.end());
  EXPECT_EQ(taken, expected);
  EXPECT_EQ(std::count(region.inside.begin(), region.inside.end(), 1), 64);
}

TEST(Region, RulesAgreeWhereAllInsideAreWanted) {
  const auto points = cloud(500);
  for (const float radius : {0.05f, 0.2f}) {
    const RegionPoints plain = select_region(points, {0, 0, 0}, radius, 128);
    const RegionPoints far = select_region(points, {0, 0, 0}, radius, 128, false, SphereRule::farthest);
    EXPECT_LE(plain.points_inside, 128);
    EXPECT_EQ(plain.index, far.index);
    EXPECT_EQ(plain.inside, far.inside);
  }
  const RegionPoints all = select_region(points, {0, 0, 0}, 0.05f, 128, true, SphereRule::farthest);
  EXPECT_EQ(all.points_inside, 500);
  EXPECT_EQ(std::count(all.inside.begin(), all.inside.end(), 1), 128);
}

TEST(Region, RuleFollowsFromTheNumberOfCandidates) {
  NetworkShape shape;
  EXPECT_EQ(sphere_rule(shape), SphereRule::scene_order);
  shape.scene_points = 65536;
  EXPECT_EQ(sphere_rule(shape), SphereRule::farthest);
}

TEST(Region, PadsWithTheNearestOutsideAndSaysSo) {
  const auto points = cloud(50);
  const Eigen::Vector3f center(0, 0, 0);
  const RegionPoints region = select_region(points, center, 0.15f, 16);
  ASSERT_LT(region.points_inside, 16);
  float farthest_taken = 0;
  int inside = 0;
  for (std::size_t i = 0; i < region.index.size(); ++i) {
    const float d = points[static_cast<std::size_t>(region.index[i])].position.norm();
    EXPECT_EQ(region.inside[i] != 0, d <= 0.15f);
    inside += region.inside[i];
    farthest_taken = std::max(farthest_taken, d);
  }
  EXPECT_EQ(inside, region.points_inside);
  int nearer = 0;
  for (const auto& p : points) nearer += p.position.norm() <= farthest_taken;
  EXPECT_EQ(nearer, 16);
}

TEST(Region, FillsUpFromAnEmptySphereAndATinyScene) {
  const auto points = cloud(3);
  const RegionPoints far = select_region(points, {9, 9, 9}, 0.1f, 8);
  EXPECT_EQ(far.points_inside, 0);
  EXPECT_EQ(far.index.size(), 8u);
  EXPECT_EQ(select_region(points, {0, 0, 0}, 5.f, 8).index.size(), 8u);
  EXPECT_THROW(select_region({}, {0, 0, 0}, 1.f, 8), std::invalid_argument);
}

TEST(ScenePoints, LieOnTheThingsAndCoverThem) {
  const Demo demo = testing::toy_push_buttons(4);
  NetworkShape shape;
  const PreparedScene scene = prepare_scene(demo.start, demo.bounds, shape);
  EXPECT_NEAR(scene.plane_z, testing::table_z, 0.004);
  EXPECT_LE(scene.points.size(), static_cast<std::size_t>(shape.scene_points));
  EXPECT_EQ(scene.patches.size(), 2 * static_cast<std::size_t>(shape.image_tokens));
  // Every button's cap holds candidate points, at its height.
  for (const Keyframe& k : demo.keyframes) {
    int near = 0;
    for (const ScenePoint& p : scene.points) {
      const Eigen::Vector3d d = p.position.cast<double>() - k.action.world_from_tool.position;
      near += d.head<2>().norm() < 0.02 && std::abs(p.position.z() - (testing::table_z + 0.032)) < 0.002;
    }
    EXPECT_GT(near, 8);
  }
}

TEST(ScenePoints, KeepEveryPixelWhereTheGridHasNoSize) {
  const Demo demo = testing::toy_push_buttons(4);
  NetworkShape shape;
  shape.scene_points = 65536;
  shape.voxel_m = 0;
  const PreparedScene scene = prepare_scene(demo.start, demo.bounds, shape);
  const Box workspace = workspace_of(demo.bounds);
  std::size_t pixels = 0;
  for (const View& view : demo.start.views)
    for (int y = 0; y < view.camera.height; ++y)
      for (int x = 0; x < view.camera.width; ++x) {
        const float depth = view.depth.at(x, y);
        pixels += depth > 0 && workspace.contains(view.camera.unproject(x + 0.5, y + 0.5, depth));
      }
  EXPECT_EQ(scene.points.size(), pixels);
  EXPECT_GT(pixels, 10000u);
}

TEST(ScenePoints, RefuseAPictureThatDoesNotFit) {
  Demo demo = testing::toy_push_buttons(4);
  NetworkShape shape;
  EXPECT_THROW(prepare_scene({}, demo.bounds, shape), std::invalid_argument);
  EXPECT_THROW(prepare_scene(demo.start, {{90, 90, 90}, {91, 91, 91}}, shape), std::invalid_argument);
  demo.start.views[1].depth.data.pop_back();
  EXPECT_THROW(prepare_scene(demo.start, demo.bounds, shape), std::invalid_argument);
}

TEST(Augmentation, MovesSceneHistoryAndTargetTogether) {
  const Demo demo = testing::toy_push_buttons(2);
  NetworkShape shape;
  Vocabulary vocabulary;
  vocabulary.learn(demo.info.instruction);
  const Sample sample = samples_of(demo, demo.bounds, shape, vocabulary).back();
  TrainRates rates;
  rates.jitter_m = 0;
  Random random(11);
  Augmentation kinds;
  kinds.shuffle = kinds.repaint = false;  // they move and paint parts of the scene, not all of it
  const Sample moved = augment(sample, rates, {0.25, 0, 0.8}, random, kinds);
  const Pose change = moved.target.world_from_tool * sample.target.world_from_tool.inverse();
  EXPECT_GT(change.rotation.angularDistance(Eigen::Quaterniond::Identity()), 0.01);
  EXPECT_LT((change.rotation * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitZ()).norm(), 1e-9);
  // Some points are left out; the others keep their order.
  const auto& before = sample.input.scene->points;
  std::vector<std::size_t> source;
  for (const ScenePoint& p : moved.input.scene->points) {
    std::size_t i = source.empty() ? 0 : source.back() + 1;
    while (i < before.size() &&
           (p.position.cast<double>() - change * before[i].position.cast<double>()).norm() > 1e-5)
      ++i;
    ASSERT_LT(i, before.size()) << "a point that was not there";
    source.push_back(i);
  }
  EXPECT_GT(source.size(), before.size() * 3 / 4);
  const Pose now = moved.input.history.back().world_from_tool;
  EXPECT_LT(position_error_m(now, change * sample.input.history.back().world_from_tool), 1e-9);
  // Colours turn together: the distance of a point's colour to a colour word's stays.
  const auto distance = [](const Sample& s, std::size_t point) {
    for (const Word& w : s.input.words)
      if (w.row == Vocabulary::color) return (s.input.scene->points[point].color - w.color).norm();
    return -1.f;
  };
  for (std::size_t i = 0; i < 50; ++i) EXPECT_NEAR(distance(sample, source[i]), distance(moved, i), 1e-5);
}

}  // namespace
}  // namespace flowscope
