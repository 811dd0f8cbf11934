#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <numbers>

#include "recorder/world.h"
#include "render/camera_model.h"

namespace flowscope {
namespace {

/// A scene camera at 256x256; MuJoCo cameras look along -z with y up.
CameraModel camera(const World& world, const char* name) {
  const mjModel* model = world.model();
  const int id = mj_name2id(model, mjOBJ_CAMERA, name);
  EXPECT_GE(id, 0) << name;
  Eigen::Vector4d wxyz;
  mju_mat2Quat(wxyz.data(), world.data()->cam_xmat + 9 * id);
  const Pose world_from_mujoco =
      Pose::from_wxyz(Eigen::Map<const Eigen::Vector3d>(world.data()->cam_xpos + 3 * id), wxyz);
  const Pose mujoco_from_camera = Pose::from_wxyz({0, 0, 0}, {0, 1, 0, 0});
  return CameraModel::from_vertical_fov(name, 256, 256, model->cam_fovy[id] * std::numbers::pi / 180,
                                        world_from_mujoco * mujoco_from_camera);
}

TEST(Cameras, StandWhereTheBenchmarkHasThem) {
  const World world(TaskLibrary(FLOWSCOPE_SOURCE_DIR "/assets").get("push_buttons"));
  const CameraModel front = camera(world, "front");
  EXPECT_NEAR(front.fx, 351.68, 0.01);
  const Eigen::Vector3d center = front.project({0.25, 0, 0.752});
  EXPECT_NEAR(center.x(), 128, 0.5);
  EXPECT_NEAR(center.y(), 202, 1);
  EXPECT_GT(front.project({0.25, 0.2, 0.752}).x(), 128) << "the robot's left is right in the picture";
  const CameraModel wrist = camera(world, "wrist");
  EXPECT_NEAR(wrist.fx, 221.70, 0.01);
  EXPECT_LT((wrist.world_from_camera.position - Eigen::Vector3d(0.3044, -0.0062, 1.5747)).norm(), 1e-4);
}

}  // namespace
}  // namespace flowscope
