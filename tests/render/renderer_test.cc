#include "render/renderer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>
#include <thread>

#include "tests/support/small_scene.h"

namespace flowscope {
namespace {

using testing::compile;
using testing::initial_state;

constexpr const char* table_scene = R"(
<mujoco>
  <statistic extent="1"/>
  <visual><map znear="0.01" zfar="5"/><headlight ambient="0.9 0.9 0.9" diffuse="0 0 0" specular="0 0 0"/></visual>
  <asset><material name="paint" rgba="0 0 1 1"/></asset>
  <worldbody>
    <camera name="front" pos="1.35 0 1.58" xyaxes="0 1 0 -0.4226 0 0.9063" fovy="40"/>
    <geom name="floor" type="plane" size="3 3 0.1" rgba="0.4 0.4 0.4 1"/>
    <geom name="hidden" type="sphere" size="0.3" pos="0 0 0.5" group="3" rgba="1 1 0 1"/>
    <site name="place" pos="0.2 0 0.2" size="0.1" rgba="1 0 1 1"/>
    <body name="red" pos="0.25 -0.3 0.752">
      <freejoint/><geom type="sphere" size="0.03" rgba="1 0 0 1"/>
    </body>
    <body name="fixture" mocap="true" pos="-0.2 0.3 0.9">
      <geom type="box" size="0.04 0.04 0.04" material="paint"/>
      <camera name="rider" pos="0 0 0.5" fovy="60"/>
    </body>
  </worldbody>
</mujoco>)";

RendererOptions small() { return {320, 240, 0, false}; }

/// Looks straight down from `height_m` above the world origin; image x is world x, image y is minus world y.
CameraModel overhead(int width, int height, double height_m) {
  const Eigen::Quaterniond rotation(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX()));
  CameraModel camera =
      CameraModel::from_vertical_fov("overhead", width, height, 0.8, {{0, 0, height_m}, rotation});
  camera.far_m = 5;
  return camera;
}

/// Mean pixel position of everything that is much redder (channel 0) or bluer (2) than the rest; x < 0: none.
Eigen::Vector2d centre_of(const ImageRgb& image, int channel) {
  Eigen::Vector2d sum(0, 0);
  int count = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const auto* p = image.at(x, y);
      if (p[channel] < 120 || p[(channel + 1) % 3] > 60 || p[(channel + 2) % 3] > 60) continue;
      sum += Eigen::Vector2d(x + 0.5, y + 0.5);
      ++count;
    }
  }
  return count > 0 ? Eigen::Vector2d(sum / count) : Eigen::Vector2d(-1, -1);
}

TEST(Renderer, DepthIsMetresAlongTheCameraAxis) {
  const auto model = compile(R"(<mujoco><worldbody>
    <geom type="plane" size="5 5 0.1"/><geom type="box" size="0.2 0.2 0.15" pos="0 0 0.15"/></worldbody></mujoco>)");
  Renderer renderer(model.get(), "box", small());
  const View view = renderer.observe(initial_state(model.get(), "box"), overhead(161, 121, 2.0));
  EXPECT_NEAR(view.depth.at(80, 60), 1.7, 1e-3);
  for (const auto& [x, y] : {std::pair{2, 2}, {158, 3}, {1, 118}, {159, 119}}) {
    EXPECT_NEAR(view.depth.at(x, y), 2.0, 1e-3) << "pixel " << x << ", " << y;
  }
}

TEST(Renderer, DepthIsExactWithMultisamplingToo) {
  const auto model = compile(
      R"(<mujoco><worldbody><geom type="box" size="0.2 0.2 0.15" pos="0 0 0.15"/></worldbody></mujoco>)");
  Renderer renderer(model.get(), "box", {160, 120, 4, false});
  const View view = renderer.observe(initial_state(model.get(), "box"), overhead(160, 120, 2.0));
  EXPECT_NEAR(view.depth.at(80, 60), 1.7, 1e-3);
  EXPECT_EQ(view.depth.at(1, 1), 0.0f);
}

TEST(Renderer, DepthIsZeroWhereNothingIsHit) {
  const auto model = compile(R"(<mujoco><worldbody><geom type="sphere" size="0.1"/></worldbody></mujoco>)");
  Renderer renderer(model.get(), "ball", small());
  const View view = renderer.observe(initial_state(model.get(), "ball"), overhead(64, 64, 1.0));
  EXPECT_EQ(view.depth.at(2, 2), 0.0f);
  EXPECT_NEAR(view.depth.at(32, 32), 0.9, 1e-3);
}

TEST(Renderer, APointLandsWhereTheCameraModelProjectsIt) {
  const auto model = compile(table_scene);
  Renderer renderer(model.get(), "table", small());
  SceneState state = initial_state(model.get(), "table");
  for (const Eigen::Vector3d& p : {Eigen::Vector3d(0.25, -0.3, 0.75), {0.0, 0.25, 0.8}, {0.5, 0.1, 1.0}}) {
    std::copy(p.begin(), p.end(), state.qpos.begin());
    CameraModel camera = renderer.camera(state, "front", 240, 240);
    for (const auto& [dx, dy] : {std::pair{0.0, 0.0}, {25.0, -18.0}}) {
      camera.cx = 120 + dx;
      camera.cy = 120 + dy;
      const Eigen::Vector3d expected = camera.project(p);
      const Eigen::Vector2d seen = centre_of(renderer.draw(state, camera), 0);
      EXPECT_NEAR(seen.x(), expected.x(), 0.5);
      EXPECT_NEAR(seen.y(), expected.y(), 0.5);
    }
  }
}

TEST(Renderer, TableCentreIsWhereTheBenchmarkHasIt) {
  const auto model = compile(table_scene);
  Renderer renderer(model.get(), "table", small());
  const CameraModel camera = renderer.camera(initial_state(model.get(), "table"), "front", 256, 240);
  CameraModel square = camera;
  square.height = 256;
  square.fx = square.fy = camera.fy * 256 / 240;
  square.cy = 128;
  const Eigen::Vector3d uvz = square.project({0.25, 0, 0.752});
  EXPECT_NEAR(uvz.x(), 128, 0.5);
  EXPECT_EQ(std::floor(uvz.y()), 202);
  EXPECT_NEAR(square.fy, 351.68, 0.05);
}

TEST(Renderer, CloudOfAllViewsLiesOnTheSurfacesInTheWorldFrame) {
  const auto model = compile(table_scene);
  Renderer renderer(model.get(), "table", small());
  SceneState state = initial_state(model.get(), "table");
  Observation observation = renderer.observe_all(state, {"front"}, 200);
  observation.views.push_back(renderer.observe(state, overhead(200, 200, 2.5)));
  const Box around_red{{0.2, -0.35, 0.7}, {0.3, -0.25, 0.8}};
  const PointCloud cloud = to_point_cloud(observation, around_red);
  ASSERT_GT(cloud.size(), 50u);
  int per_view[2] = {0, 0};
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const double radius = (cloud.position[i].cast<double>() - Eigen::Vector3d(0.25, -0.3, 0.752)).norm();
    EXPECT_NEAR(radius, 0.03, 2e-3);  // the sphere is drawn as facets
    EXPECT_GT(cloud.color[i].x(), 0.5f);
    ++per_view[cloud.view[i]];
  }
  EXPECT_GT(per_view[0], 10);
  EXPECT_GT(per_view[1], 10);
}

TEST(Renderer, DrawsNeitherCollisionShapesNorSites) {
  const auto model = compile(table_scene);
  Renderer renderer(model.get(), "table", small());
  const View view = renderer.observe(initial_state(model.get(), "table"), overhead(100, 100, 2.5));
  EXPECT_NEAR(view.depth.at(50, 50), 2.5, 1e-3);
}

TEST(Renderer, FollowsMocapBodiesTheirCamerasAndMaterialColours) {
  const auto model = compile(table_scene);
  Renderer renderer(model.get(), "table", small());
  SceneState state = initial_state(model.get(), "table");
  const CameraModel camera = overhead(200, 200, 2.5);
  EXPECT_LT((centre_of(renderer.draw(state, camera), 2) - camera.project({-0.2, 0.3, 0.94}).head<2>()).norm(),
            2);
  state.mocap_pos = {0.1, -0.1, 0.5};
  EXPECT_LT((centre_of(renderer.draw(state, camera), 2) - camera.project({0.1, -0.1, 0.54}).head<2>()).norm(),
            1);
  const Pose rider = renderer.camera(state, "rider", 64, 64).world_from_camera;
  EXPECT_LT((rider.position - Eigen::Vector3d(0.1, -0.1, 1.0)).norm(), 1e-9);
  EXPECT_LT((rider.rotation * Eigen::Vector3d::UnitZ() - Eigen::Vector3d(0, 0, -1)).norm(), 1e-9);
  state.mat_rgba = {0, 1, 0, 1};
  EXPECT_LT(centre_of(renderer.draw(state, camera), 2).x(), 0);
}

TEST(Renderer, RefusesAStateOfAnotherSceneOrSize) {
  const auto model = compile(table_scene);
  Renderer renderer(model.get(), "table", small());
  const SceneState good = initial_state(model.get(), "table");
  SceneState foreign = good;
  foreign.scene = "drawer";
  EXPECT_THROW(renderer.draw(foreign, overhead(64, 64, 2)), std::invalid_argument);
  SceneState longer = good;
  longer.qpos.push_back(0);
  EXPECT_THROW(renderer.draw(longer, overhead(64, 64, 2)), std::invalid_argument);
  SceneState broken = good;
  broken.qpos[1] = std::nan("");
  EXPECT_THROW(renderer.draw(broken, overhead(64, 64, 2)), std::invalid_argument);
  EXPECT_NO_THROW(renderer.draw(good, overhead(64, 64, 2)));
}

TEST(Renderer, RefusesCamerasItCannotDraw) {
  const auto model = compile(table_scene);
  Renderer renderer(model.get(), "table", small());
  const SceneState state = initial_state(model.get(), "table");
  EXPECT_THROW(renderer.draw(state, overhead(321, 64, 2)), std::invalid_argument);
  EXPECT_THROW(renderer.draw(state, overhead(0, 64, 2)), std::invalid_argument);
  CameraModel stretched = overhead(64, 64, 2);
  stretched.fx *= 2;
  EXPECT_THROW(renderer.draw(state, stretched), std::invalid_argument);
  EXPECT_THROW(renderer.camera(state, "back", 64, 64), std::invalid_argument);
}

TEST(Renderer, SeveralOnOneThreadDoNotDisturbEachOther) {
  const auto model = compile(table_scene);
  const SceneState state = initial_state(model.get(), "table");
  const CameraModel camera = overhead(120, 90, 2.5);
  ImageRgb alone;
  { alone = Renderer(model.get(), "table", small()).draw(state, camera); }
  Renderer first(model.get(), "table", small());
  Renderer second(model.get(), "table", {64, 64, 0, true});
  second.draw(state, overhead(64, 64, 1.5));
  EXPECT_EQ(first.draw(state, camera), alone);
  EXPECT_NO_THROW(probe_egl());
  EXPECT_EQ(first.draw(state, camera), alone);
}

TEST(Renderer, PartsMakeTheSamePictureInASmallerBufferAndCanBeGivenUp) {
  const auto model = compile(table_scene);
  const SceneState state = initial_state(model.get(), "table");
  Overlay overlay;
  overlay.spheres.push_back({{0, 0, 0.6}, 0.5, {0.2f, 0.4f, 1, 0.3f}});
  overlay.labels.push_back({{0.1, 0.1, 0.8}, "half-way"});
  OverlayPoints points;
  for (int i = 0; i < 400; ++i) points.points.emplace_back(0.05 * (i % 20) - 0.5, 0.05 * (i / 20) - 0.5, 0.9);
  points.size_m = 0.02;
  points.color = palette::inside;
  overlay.points.push_back(points);
  overlay.frames.push_back({Pose{}, 0.3});
  RendererOptions whole{301, 203, 4, true}, parts = whole;
  parts.part = 64;
  int calls = 0;
  parts.before_part = [&] { ++calls; };
  CameraModel camera = overhead(301, 203, 2.5);
  const ImageRgb expected = Renderer(model.get(), "table", whole).draw(state, camera, overlay);
  Renderer in_parts(model.get(), "table", parts);
  const ImageRgb seen = in_parts.draw(state, camera, overlay);
  EXPECT_GE(calls, 5 * 4);
  int different = 0;
  for (std::size_t i = 0; i < seen.data.size(); ++i)
    different += std::abs(seen.data[i] - expected.data[i]) > 8;
  EXPECT_LT(different, static_cast<int>(seen.data.size() / 500)) << "a few edges may round otherwise";
  EXPECT_THROW(in_parts.observe(state, camera), std::invalid_argument);

  RendererOptions given_up = parts;
  given_up.before_part = [&] {
    if (++calls > 0) throw std::runtime_error("enough");
  };
  calls = -3;
  Renderer stopped(model.get(), "table", given_up);
  EXPECT_THROW(stopped.draw(state, camera, overlay), std::runtime_error);
  EXPECT_EQ(calls, 1);
}

TEST(Renderer, BelongsToTheThreadThatMadeIt) {
  const auto model = compile(table_scene);
  Renderer renderer(model.get(), "table", small());
  const SceneState state = initial_state(model.get(), "table");
  bool refused = false;
  std::thread([&] {
    try {
      renderer.draw(state, overhead(64, 64, 2));
    } catch (const std::logic_error&) {
      refused = true;
    }
  }).join();
  EXPECT_TRUE(refused);
  EXPECT_NO_THROW(renderer.draw(state, overhead(64, 64, 2)));
}

TEST(Egl, ProbeNamesTheDriver) {
  const EglInfo info = probe_egl();
  EXPECT_FALSE(info.platform.empty());
  EXPECT_FALSE(info.renderer.empty());
}

}  // namespace
}  // namespace flowscope
