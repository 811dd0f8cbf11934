#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "render/camera_model.h"
#include "render/observation.h"
#include "tests/support/small_scene.h"

namespace flowscope {
namespace {

TEST(CameraModel, ProjectAndUnprojectAreInverse) {
  CameraModel camera = CameraModel::from_vertical_fov(
      "test", 320, 200, 0.9, {{0.4, -1, 2}, Eigen::Quaterniond(0.3, -0.8, 0.4, 0.1).normalized()});
  camera.cx += 13;
  camera.cy -= 7;
  for (const auto& [u, v, z] : {std::tuple{0.0, 0.0, 0.5}, {160.0, 100.0, 1.0}, {319.5, 3.25, 4.0}}) {
    const Eigen::Vector3d uvz = camera.project(camera.unproject(u, v, z));
    EXPECT_LT((uvz - Eigen::Vector3d(u, v, z)).norm(), 1e-9);
  }
  EXPECT_NEAR(camera.fovy_rad(), 0.9, 1e-12);
}

TEST(OrbitCamera, HasTheAnglesOfMujocosFreeCamera) {
  const auto model = testing::compile("<mujoco><worldbody><geom size='0.1'/></worldbody></mujoco>");
  const DataPtr data(mj_makeData(model.get()));
  VisualScene visual(model.get(), 10);
  for (const auto& [azimuth, elevation] :
       {std::pair{0.0, 0.0}, {150.0, -25.0}, {-70.0, 40.0}, {90.0, -89.0}}) {
    const OrbitCamera orbit{azimuth, elevation, 1.7, {0.1, 0.2, 0.9}, 45};
    const CameraModel camera = orbit.model(640, 480);
    mjvCamera free;
    mjv_defaultFreeCamera(model.get(), &free);
    free.azimuth = azimuth;
    free.elevation = elevation;
    free.distance = orbit.distance_m;
    std::copy(orbit.lookat.begin(), orbit.lookat.end(), free.lookat);
    mjv_updateCamera(model.get(), data.get(), &free, &visual.scene);
    const mjvGLCamera gl = mjv_averageCamera(&visual.scene.camera[0], &visual.scene.camera[1]);
    const Eigen::Matrix3d axes = camera.world_from_camera.rotation.toRotationMatrix();
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(camera.world_from_camera.position[i], gl.pos[i], 1e-5);
      EXPECT_NEAR(axes(i, 2), gl.forward[i], 1e-5);
      EXPECT_NEAR(-axes(i, 1), gl.up[i], 1e-5);
    }
    const Eigen::Vector3d uvz = camera.project(orbit.lookat);
    EXPECT_LT((uvz - Eigen::Vector3d(320, 240, 1.7)).norm(), 1e-9);
  }
}

TEST(OrbitCamera, RefusesNonsense) {
  EXPECT_THROW(OrbitCamera{}.model(0, 480), std::invalid_argument);
  OrbitCamera flat;
  flat.distance_m = 0;
  EXPECT_THROW(flat.model(640, 480), std::invalid_argument);
  OrbitCamera broken;
  broken.azimuth_deg = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(broken.model(640, 480), std::invalid_argument);
}

/// A 4 x 3 view that looks along world +x from x = 1; every pixel sees a wall at depth 2.
View wall() {
  const Eigen::Matrix3d axes = (Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished();
  View view;
  view.camera = CameraModel::from_vertical_fov("wall", 4, 3, 1.0, {{1, 0, 0}, Eigen::Quaterniond(axes)});
  view.rgb = ImageRgb(4, 3);
  view.depth = DepthImage(4, 3);
  std::fill(view.depth.data.begin(), view.depth.data.end(), 2.0f);
  return view;
}

const Box everywhere{Eigen::Vector3d::Constant(-100), Eigen::Vector3d::Constant(100)};

TEST(PointCloud, PixelsBecomeWorldPoints) {
  Observation observation{{wall(), wall()}};
  observation.views[1].rgb.at(3, 0)[0] = 255;
  const PointCloud cloud = to_point_cloud(observation, everywhere);
  ASSERT_EQ(cloud.size(), 24u);
  const CameraModel& camera = observation.views[0].camera;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3d uvz = camera.project(cloud.position[i].cast<double>());
    EXPECT_NEAR(uvz.x(), cloud.pixel[i] % 4 + 0.5, 1e-5);
    EXPECT_NEAR(uvz.y(), cloud.pixel[i] / 4 + 0.5, 1e-5);
    EXPECT_NEAR(cloud.position[i].x(), 3, 1e-6);
    EXPECT_EQ(cloud.color[i].x(), cloud.view[i] == 1 && cloud.pixel[i] == 3 ? 1.0f : 0.0f);
  }
  // Image right is world -y, image top is world +z.
  EXPECT_GT(cloud.position[0].y(), cloud.position[3].y());
  EXPECT_GT(cloud.position[0].z(), cloud.position[8].z());
}

TEST(PointCloud, LeavesOutInvalidDepthAndWhatIsOutsideTheWorkspace) {
  View view = wall();
  view.depth.at(0, 0) = 0;
  view.depth.at(1, 0) = std::numeric_limits<float>::quiet_NaN();
  view.depth.at(2, 0) = std::numeric_limits<float>::infinity();
  view.depth.at(3, 0) = -1;
  view.depth.at(0, 1) = 50;
  EXPECT_EQ(to_point_cloud({{view}}, {{0, -5, -5}, {10, 5, 5}}).size(), 7u);
}

TEST(PointCloud, RefusesViewsWhoseSizesDiffer) {
  View view = wall();
  view.rgb = ImageRgb(3, 4);
  EXPECT_THROW(to_point_cloud({{view}}, everywhere), std::invalid_argument);
}

}  // namespace
}  // namespace flowscope
