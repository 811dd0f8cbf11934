// An overlay changes the picture where it should and nowhere else.
#include "render/overlay.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "render/gripper_shape.h"
#include "render/renderer.h"
#include "tests/support/small_scene.h"

namespace flowscope {
namespace {

/// A grey block on a floor, seen from straight above: image x is world x, image y is minus world y.
class OverlayTest : public ::testing::Test {
 protected:
  OverlayTest() { camera.far_m = 5; }

  ImageRgb draw(const Overlay& overlay) { return renderer.draw(state, camera, overlay); }
  std::array<int, 2> pixel(const Eigen::Vector3d& world) const {
    const Eigen::Vector3d uvz = camera.project(world);
    return {static_cast<int>(uvz.x()), static_cast<int>(uvz.y())};
  }
  /// Largest channel difference at the pixel that shows `world`.
  static int change(const ImageRgb& a, const ImageRgb& b, const std::array<int, 2>& at) {
    int largest = 0;
    for (int c = 0; c < 3; ++c)
      largest = std::max(largest, std::abs(a.at(at[0], at[1])[c] - b.at(at[0], at[1])[c]));
    return largest;
  }
  static int changed_pixels(const ImageRgb& a, const ImageRgb& b) {
    int count = 0;
    for (int y = 0; y < a.height; ++y) {
      for (int x = 0; x < a.width; ++x) count += change(a, b, {x, y}) > 2;
    }
    return count;
  }

  ModelPtr model = testing::compile(R"(<mujoco><worldbody>
    <light pos="0.2 0.3 2" dir="-0.1 -0.1 -1"/>
    <geom type="plane" size="3 3 0.1" rgba="0.4 0.4 0.4 1"/>
    <geom type="box" size="0.1 0.1 0.1" pos="0 0 0.1" rgba="0.5 0.5 0.5 1"/></worldbody></mujoco>)");
  Renderer renderer{model.get(), "block", {200, 200, 0, true}};
  SceneState state = testing::initial_state(model.get(), "block");
  CameraModel camera = CameraModel::from_vertical_fov(
      "above", 200, 200, 0.6,
      {{0, 0, 1.6}, Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX()))});
  ImageRgb plain = draw({});
};

TEST_F(OverlayTest, SphereTintsWhatItCoversAndNothingElse) {
  Overlay overlay;
  overlay.spheres.push_back({{0.25, 0, 0.05}, 0.1, palette::region});
  const ImageRgb picture = draw(overlay);
  EXPECT_GT(change(picture, plain, pixel({0.25, 0, 0})), 10);
  EXPECT_EQ(change(picture, plain, pixel({-0.25, 0, 0})), 0);
  // Circle of the sphere's apparent size, seen from 1.55 m above its centre.
  const double radius = camera.fx * 0.1 / std::sqrt(1.55 * 1.55 - 0.01);
  EXPECT_NEAR(changed_pixels(picture, plain), std::numbers::pi * radius * radius, 0.05 * radius * radius);
}

TEST_F(OverlayTest, SphereCastsNoShadow) {
  Overlay overlay;
  overlay.spheres.push_back({{0, 0, 0.6}, 0.02, palette::region});
  overlay.lines.push_back({{{-0.02, 0, 0.6}, {0.02, 0, 0.6}}, 0.02, palette::expert, {}});
  const ImageRgb picture = draw(overlay);
  for (int y = 0; y < 200; ++y) {
    for (int x = 0; x < 200; ++x) {
      if (std::hypot(x - 100, y - 100) <= 25) continue;
      ASSERT_EQ(change(picture, plain, {x, y}), 0) << x << ", " << y;
    }
  }
}

TEST_F(OverlayTest, LineBlendsFromItsFirstColourToItsLast) {
  Overlay overlay;
  overlay.lines.push_back(
      {{{-0.3, 0.2, 0.01}, {0, 0.2, 0.01}, {0.3, 0.2, 0.01}}, 0.02, {1, 0, 0, 1}, {0, 0, 1, 1}});
  const ImageRgb picture = draw(overlay);
  const auto [x0, y0] = pixel({-0.28, 0.2, 0.01});
  const auto [x1, y1] = pixel({0.28, 0.2, 0.01});
  EXPECT_GT(picture.at(x0, y0)[0], picture.at(x0, y0)[2] + 80);
  EXPECT_GT(picture.at(x1, y1)[2], picture.at(x1, y1)[0] + 80);
  EXPECT_EQ(change(picture, plain, pixel({0, -0.2, 0})), 0);
}

TEST_F(OverlayTest, WhatIsInsideAnObjectShinesThrough) {
  Overlay inside, above;
  inside.lines.push_back({{{-0.05, 0, 0.1}, {0.05, 0, 0.1}}, 0.03, {0, 1, 0, 1}, {}});
  above.lines.push_back({{{-0.05, 0, 0.25}, {0.05, 0, 0.25}}, 0.03, {0, 1, 0, 1}, {}});
  const int faint = change(draw(inside), plain, pixel({0, 0, 0.1}));
  const int full = change(draw(above), plain, pixel({0, 0, 0.25}));
  EXPECT_GT(faint, 15);
  EXPECT_GT(full, 2 * faint);
}

TEST_F(OverlayTest, PointsAreDiscsOfTheirSizeAndColour) {
  Overlay overlay;
  overlay.points.push_back(
      {{{0.2, 0.2, 0.0}, {0, 0, 5}}, 0.04, {0, 1, 1, 1}});  // the second is behind the camera
  const ImageRgb picture = draw(overlay);
  const auto [x, y] = pixel({0.2, 0.2, 0});
  EXPECT_LT(picture.at(x, y)[0], 10);
  EXPECT_GT(picture.at(x, y)[1], 240);
  const double radius = 0.02 * camera.fx / 1.6;
  EXPECT_NEAR(changed_pixels(picture, plain), std::numbers::pi * radius * radius,
              2 * std::numbers::pi * radius);
}

TEST_F(OverlayTest, GhostShowsItsHandFingersAndOpening) {
  // The tool points to world +x, its fingers open along world y, so that the camera above sees hand and
  // fingers.
  const Eigen::Matrix3d world_from_tool_axes = (Eigen::Matrix3d() << 0, 0, 1, 0, 1, 0, -1, 0, 0).finished();
  const Pose world_from_tool{{0, 0, 0.4}, Eigen::Quaterniond(world_from_tool_axes)};
  Overlay open, closed;
  open.ghosts.push_back({world_from_tool, 1, palette::prediction});
  closed.ghosts.push_back({world_from_tool, 0, palette::prediction});
  const ImageRgb picture = draw(open);
  EXPECT_GT(change(picture, plain, pixel({-0.075, 0, 0.4})), 30) << "hand";
  EXPECT_GT(change(picture, plain, pixel({-0.075, 0.09, 0.4})), 30) << "hand, along the opening axis";
  EXPECT_GT(change(picture, plain, pixel({-0.01, 0.046, 0.4})), 30) << "left finger";
  EXPECT_GT(change(picture, plain, pixel({-0.01, -0.046, 0.4})), 30) << "right finger";
  EXPECT_EQ(change(picture, plain, pixel({-0.01, 0, 0.4})), 0) << "between the fingers";
  EXPECT_EQ(change(picture, plain, pixel({0.04, 0, 0.4})), 0) << "beyond the fingertips";
  EXPECT_GT(change(draw(closed), plain, pixel({-0.01, 0.006, 0.4})), 30) << "closed fingers";
}

TEST_F(OverlayTest, GhostHasTheShapeOfTheRobotsOwnHand) {
  // Seen from above: a plate that is a mesh and stays, a ball that goes along an arc of three places.
  const ModelPtr hand = testing::compile(R"(<mujoco><asset>
    <mesh name="other" vertex="0 0 0  1 0 0  0 1 0  0 0 1"/>
    <mesh name="plate" vertex="-.1 -.02 0  .1 -.02 0  -.1 .02 0  .1 .02 0  -.1 -.02 .01  .1 -.02 .01  -.1 .02 .01  .1 .02 .01"/>
    </asset><worldbody><light pos="0.2 0.3 2" dir="-0.1 -0.1 -1"/><geom type="plane" size="3 3 0.1"/>
    <geom type="mesh" mesh="other" pos="0 9 0"/><geom type="mesh" mesh="plate" pos="0 9 0"/></worldbody></mujoco>)");
  GripperShape shape;
  // The engine turns a mesh onto its principal axes; its geom turns it back.
  const Pose plate = Pose::from_wxyz({0, 0, 0}, Eigen::Map<Eigen::Vector4d>(hand->geom_quat + 4 * 2));
  const auto at = [](double x, double y) { return Pose{{x, y, 0}, Eigen::Quaterniond::Identity()}; };
  shape.parts.push_back({mjGEOM_MESH, 1, {0, 0, 0}, {plate, plate}});
  shape.parts.push_back({mjGEOM_SPHERE, -1, {0.02, 0.02, 0.02}, {at(0.1, 0.2), at(0.2, 0.2), at(0.2, 0.1)}});
  RendererOptions options{200, 200, 0, true};
  options.gripper = std::make_shared<GripperShape>(shape);
  Renderer own(hand.get(), "hand", options);
  const SceneState rest = testing::initial_state(hand.get(), "hand");
  const ImageRgb before = own.draw(rest, camera);
  for (const double openness : {0.0, 0.5, 1.0}) {
    Overlay overlay;
    overlay.ghosts.push_back({{{0, 0, 0.2}, Eigen::Quaterniond::Identity()}, openness, palette::failure});
    const ImageRgb picture = own.draw(rest, camera, overlay);
    EXPECT_GT(change(picture, before, pixel({0.09, 0, 0.2})), 30) << "the plate's long side";
    EXPECT_EQ(change(picture, before, pixel({0, 0.05, 0.2})), 0) << "beside its short side";
    EXPECT_EQ(change(picture, before, pixel({0.1, 0.2, 0.2})) > 30, openness == 0.0);
    EXPECT_EQ(change(picture, before, pixel({0.2, 0.2, 0.2})) > 30, openness == 0.5);
    EXPECT_EQ(change(picture, before, pixel({0.2, 0.1, 0.2})) > 30, openness == 1.0);
  }
}

TEST_F(OverlayTest, FrameHasRedGreenBlueAxes) {
  Overlay overlay;
  overlay.frames.push_back({{{0.2, 0.2, 0.05}, Eigen::Quaterniond::Identity()}, 0.1, 1});
  const ImageRgb picture = draw(overlay);
  const auto [x_red, y_red] = pixel({0.25, 0.2, 0.05});
  const auto [x_green, y_green] = pixel({0.2, 0.25, 0.05});
  EXPECT_GT(picture.at(x_red, y_red)[0], picture.at(x_red, y_red)[1] + 60);
  EXPECT_GT(picture.at(x_green, y_green)[1], picture.at(x_green, y_green)[0] + 60);
}

TEST_F(OverlayTest, LabelWritesBesideItsPoint) {
  Overlay overlay;
  overlay.labels.push_back({{-0.2, 0, 0}, "t = 0.5 \xC3\xA9\n"});
  const ImageRgb picture = draw(overlay);
  EXPECT_GT(changed_pixels(picture, plain), 40);
  const auto [x, y] = pixel({-0.2, 0, 0});
  int near_point = 0;
  for (int dy = -30; dy < 10; ++dy) {
    for (int dx = 0; dx < 60; ++dx) near_point += change(picture, plain, {x + dx, y + dy}) > 2;
  }
  EXPECT_GT(near_point, 20);
}

TEST_F(OverlayTest, BoxTintsItsOutlineAndDrawsItsEdges) {
  Overlay overlay;
  overlay.boxes.push_back(
      {{{0.25, 0, 0.05}, Eigen::Quaterniond::Identity()}, {0.08, 0.05, 0.04}, palette::unmet});
  const ImageRgb picture = draw(overlay);
  const int tint = change(picture, plain, pixel({0.25, 0, 0}));
  EXPECT_GT(tint, 10);
  EXPECT_EQ(change(picture, plain, pixel({-0.25, 0, 0})), 0);
  EXPECT_EQ(change(picture, plain, pixel({0.25, 0.08, 0.09})), 0) << "beyond its short side";
  EXPECT_GT(change(picture, plain, pixel({0.25, 0.0495, 0.09})), 2 * tint) << "an edge of its top";
  // The outline is that of the top face, 1.51 m below the camera, and of a little of what is behind it.
  const double top = camera.fx * camera.fx * 0.16 * 0.10 / (1.51 * 1.51);
  EXPECT_NEAR(changed_pixels(picture, plain), top, 0.12 * top);
}

TEST_F(OverlayTest, BoxPaintedRayByRayIsTheBoxThatTheEngineDraws) {
  // A turned box: the pixels that change are those that an opaque one would cover in the engine's own
  // picture.
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.6, Eigen::Vector3d(1, 2, 3).normalized()));
  const Pose world_from_box{{-0.2, 0.2, 0.5}, turn};
  Overlay overlay;
  overlay.boxes.push_back({world_from_box, {0.10, 0.06, 0.03}, {1, 0, 0, 1}});
  const ImageRgb picture = draw(overlay);
  const ModelPtr solid = testing::compile(R"(<mujoco><compiler angle="radian"/><worldbody>
    <light pos="0.2 0.3 2" dir="-0.1 -0.1 -1"/>
    <geom type="box" size="0.10 0.06 0.03" pos="-0.2 0.2 0.5" axisangle="1 2 3 0.6"/></worldbody></mujoco>)");
  Renderer reference(solid.get(), "solid", {200, 200, 0, true});
  const View seen = reference.observe(testing::initial_state(solid.get(), "solid"), camera);
  int wrong = 0, covered = 0;
  for (int y = 0; y < 200; ++y) {
    for (int x = 0; x < 200; ++x) {
      const bool in_engine = seen.depth.at(x, y) > 0, in_overlay = change(picture, plain, {x, y}) > 2;
      wrong += in_engine != in_overlay;
      covered += in_engine;
    }
  }
  EXPECT_GT(covered, 500);
  EXPECT_LE(wrong, covered / 50) << "rims may differ";
}

TEST_F(OverlayTest, WhatStandsInABoxIsTintedMoreThanWhatIsBehindIt) {
  Overlay around, above;
  around.boxes.push_back({{{0, 0, 0.2}, Eigen::Quaterniond::Identity()}, {0.08, 0.08, 0.05}, palette::met});
  above.boxes.push_back({{{0, 0, 0.4}, Eigen::Quaterniond::Identity()}, {0.08, 0.08, 0.05}, palette::met});
  const auto middle = pixel({0.01, 0.01, 0.2});
  EXPECT_GT(change(draw(around), plain, middle), change(draw(above), plain, middle));
  Overlay inside_block;
  inside_block.boxes.push_back(
      {{{0, 0, 0.1}, Eigen::Quaterniond::Identity()}, {0.05, 0.05, 0.05}, palette::met});
  const int hidden = change(draw(inside_block), plain, middle);
  EXPECT_GT(hidden, 0);
  EXPECT_LT(hidden, change(draw(above), plain, middle));
}

TEST_F(OverlayTest, LeavesNoTraceInTheNextPicture) {
  Overlay overlay;
  overlay.ghosts.push_back({{{0, 0, 0.4}, Eigen::Quaterniond::Identity()}, 1, palette::prediction});
  draw(overlay);
  EXPECT_EQ(draw({}), plain);
}

TEST_F(OverlayTest, VeryLongLinesAndBrokenNumbersAreHarmless) {
  Overlay overlay;
  OverlayLine spiral{{}, 0.005, palette::noise, palette::action};
  for (int i = 0; i < 20000; ++i) {
    spiral.points.emplace_back(1e-5 * i * std::cos(0.01 * i), 1e-5 * i * std::sin(0.01 * i), 0.3);
  }
  overlay.lines.push_back(spiral);
  const double nan = std::nan("");
  overlay.lines.push_back({{{nan, 0, 0}, {0, 0, 0}}, 0.01, palette::failure, {}});
  overlay.points.push_back({{{nan, 0, 0}}, 0.01, palette::inside});
  overlay.spheres.push_back({{0, 0, nan}, 0.1, palette::region});
  overlay.boxes.push_back({{{0, nan, 0}, Eigen::Quaterniond::Identity()}, {0.1, 0.1, 0.1}, palette::met});
  overlay.boxes.push_back({{{0, 0, 0}, Eigen::Quaterniond::Identity()}, {0.1, 0, 0.1}, palette::met});
  overlay.boxes.push_back({{{0, 0, 1.6}, Eigen::Quaterniond::Identity()}, {9, 9, 0.1}, {1, 1, 1, 0}});
  EXPECT_GT(changed_pixels(draw(overlay), plain), 500);
}

}  // namespace
}  // namespace flowscope
