#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

#include "policy/clip/cells.h"

namespace flowscope {
namespace {

constexpr int side = 8, stride = 4;

/// A camera at the origin that looks along z at a wall 1 m away: pixel (u, v) stands at (u - 4, v - 4, 1)
/// / 8.
View wall(const std::string& name) {
  View view;
  view.camera.name = name;
  view.camera.width = view.camera.height = side;
  view.camera.fx = view.camera.fy = side;
  view.camera.cx = view.camera.cy = 0.5 * side;
  view.rgb = ImageRgb(side, side);
  view.depth = DepthImage(side, side);
  std::fill(view.depth.data.begin(), view.depth.data.end(), 1.f);
  for (std::size_t i = 0; i < view.rgb.data.size(); i += 3) view.rgb.data[i] = 255;
  return view;
}

Box everywhere() { return {Eigen::Vector3d(-9, -9, -9), Eigen::Vector3d(9, 9, 9)}; }

TEST(ClipCells, StandAtTheMeanOfTheirPoints) {
  const Observation observation{{wall("front"), wall("wrist")}};
  const auto cells = lift_cells(observation, everywhere(), stride, 8);
  ASSERT_EQ(cells.size(), 8u);
  EXPECT_EQ(cells[0].view, 0);
  EXPECT_EQ(cells[5].view, 1);
  EXPECT_FLOAT_EQ(cells[5].x, 6);
  EXPECT_FLOAT_EQ(cells[5].y, 2);
  EXPECT_TRUE(cells[5].position.isApprox(Eigen::Vector3f(0.25f, -0.25f, 1), 1e-5f));
  EXPECT_TRUE(cells[5].color.isApprox(Eigen::Vector3f(1, 0, 0), 1e-5f));
}

TEST(ClipCells, TakeOnlyValidPointsAndLeaveOutEmptyCells) {
  Observation observation{{wall("front")}};
  DepthImage& depth = observation.views[0].depth;
  for (int y = 0; y < stride; ++y)
    for (int x = 0; x < stride; ++x) {
      depth.at(x, y) = std::numeric_limits<float>::quiet_NaN();
      depth.at(x + stride, y) = 0;
    }
  depth.at(5, 1) = 2;   // the only one of its cell
  depth.at(0, 4) = 50;  // outside the workspace
  const auto cells = lift_cells(observation, everywhere(), stride, 3);
  ASSERT_EQ(cells.size(), 3u);
  EXPECT_TRUE(cells[0].position.isApprox(Eigen::Vector3f(1.5f / 8, -2.5f / 8, 1) * 2, 1e-5f));
  EXPECT_EQ(cells[0].pixel_x, 5);
  EXPECT_EQ(cells[0].pixel_y, 1);
  // Fifteen points are left of the second one.
  EXPECT_NEAR(cells[1].position.x(), (-0.25 * 16 + 3.5 / 8) / 15, 1e-5);
  EXPECT_FLOAT_EQ(cells[1].x, 2);
}

TEST(ClipCells, TheirNumberDoesNotDependOnTheScene) {
  const Observation observation{{wall("front"), wall("wrist")}};
  const auto all = lift_cells(observation, everywhere(), stride, 8);
  const auto thinned = lift_cells(observation, everywhere(), stride, 4);
  const auto filled = lift_cells(observation, everywhere(), stride, 11);
  ASSERT_EQ(thinned.size(), 4u);
  ASSERT_EQ(filled.size(), 11u);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(thinned[i].view, all[2 * i].view);
    EXPECT_EQ(thinned[i].position, all[2 * i].position);
  }
  for (std::size_t i = 0; i < 11; ++i) {
    EXPECT_EQ(filled[i].view, all[i % 8].view);
    EXPECT_EQ(filled[i].position, all[i % 8].position);
  }
}

TEST(ClipCells, FollowPlacesThatTheCameraDoesNotKnow) {
  const Observation observation{{wall("front")}};
  const PixelPlaces places{std::vector<Eigen::Vector3d>(side * side, Eigen::Vector3d(1, 2, 3))};
  for (const CellPlace& cell : lift_cells(observation, everywhere(), stride, 4, &places))
    EXPECT_TRUE(cell.position.isApprox(Eigen::Vector3f(1, 2, 3), 1e-5f));
  const PixelPlaces none;
  EXPECT_THROW(lift_cells(observation, everywhere(), stride, 4, &none), std::invalid_argument);
}

TEST(ClipCells, SayWhatDoesNotFit) {
  const Observation observation{{wall("front")}};
  EXPECT_THROW(lift_cells({}, everywhere(), stride, 4), std::invalid_argument);
  EXPECT_THROW(lift_cells(observation, everywhere(), 3, 4), std::invalid_argument);
  EXPECT_THROW(lift_cells(observation, everywhere(), stride, 0), std::invalid_argument);
  EXPECT_THROW(lift_cells(observation, {Eigen::Vector3d(5, 5, 5), Eigen::Vector3d(6, 6, 6)}, stride, 4),
               std::invalid_argument);
}

}  // namespace
}  // namespace flowscope
