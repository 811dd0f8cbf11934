#include "render/cloud.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <string>

#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

using testing::TemporaryFolder;

void add(PointCloud& cloud, const Eigen::Vector3f& position, const Eigen::Vector3f& color) {
  cloud.position.push_back(position);
  cloud.color.push_back(color);
  cloud.view.push_back(0);
  cloud.pixel.push_back(static_cast<int>(cloud.size()));
}

std::string text_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(VoxelGrid, KeepsOneMeanPerCube) {
  PointCloud cloud;
  add(cloud, {0.01f, 0.01f, 0.01f}, {1, 0, 0});
  add(cloud, {0.03f, 0.01f, 0.01f}, {0, 0, 1});
  add(cloud, {0.21f, 0.01f, 0.01f}, {0, 1, 0});
  const PointCloud thin = voxel_grid(cloud, 0.1);
  ASSERT_EQ(thin.size(), 2u);
  const std::size_t mean = thin.position[0].x() < 0.1f ? 0 : 1;
  EXPECT_NEAR(thin.position[mean].x(), 0.02f, 1e-6f);
  EXPECT_NEAR(thin.color[mean].x(), 0.5f, 0.01f);
  EXPECT_NEAR(thin.color[mean].z(), 0.5f, 0.01f);
  EXPECT_NEAR(thin.position[1 - mean].x(), 0.21f, 1e-6f);
}

TEST(VoxelGrid, LeavesOutPointsThatAreNotFinite) {
  PointCloud cloud;
  add(cloud, {std::numeric_limits<float>::quiet_NaN(), 0, 0}, {1, 1, 1});
  add(cloud, {0, std::numeric_limits<float>::infinity(), 0}, {1, 1, 1});
  EXPECT_EQ(voxel_grid(cloud, 0.1).size(), 0u);
  add(cloud, {1, 2, 3}, {1, 1, 1});
  EXPECT_EQ(voxel_grid(cloud, 0.1).size(), 1u);
}

TEST(VoxelGrid, RefusesALeafThatPclWouldIgnore) {
  PointCloud cloud;
  add(cloud, {0, 0, 0}, {1, 1, 1});
  add(cloud, {2, 2, 2}, {1, 1, 1});
  EXPECT_THROW(voxel_grid(cloud, 1e-6), std::invalid_argument);
  EXPECT_THROW(voxel_grid(cloud, 0), std::invalid_argument);
  EXPECT_THROW(voxel_grid({}, -1), std::invalid_argument);
  EXPECT_EQ(voxel_grid(cloud, 0.01).size(), 2u);
}

TEST(WriteCloud, PlyAndPcdHoldEveryFinitePoint) {
  const TemporaryFolder folder;
  PointCloud cloud;
  for (int i = 0; i < 10; ++i) add(cloud, {0.1f * static_cast<float>(i), 0, 1}, {1, 0.5f, 0});
  add(cloud, {std::numeric_limits<float>::quiet_NaN(), 0, 0}, {1, 1, 1});
  write_cloud(folder.path() / "a.ply", cloud);
  write_cloud(folder.path() / "a.pcd", cloud);
  EXPECT_NE(text_of(folder.path() / "a.ply").find("element vertex 10\n"), std::string::npos);
  const std::string pcd = text_of(folder.path() / "a.pcd");
  EXPECT_NE(pcd.find("POINTS 10\n"), std::string::npos);
  EXPECT_NE(pcd.find("FIELDS x y z rgb"), std::string::npos);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 2);
}

TEST(WriteCloud, RefusesWhatItCannotWrite) {
  const TemporaryFolder folder;
  PointCloud cloud;
  EXPECT_THROW(write_cloud(folder.path() / "a.ply", cloud), std::invalid_argument);
  add(cloud, {0, 0, 0}, {1, 1, 1});
  EXPECT_THROW(write_cloud(folder.path() / "a.obj", cloud), std::invalid_argument);
  EXPECT_ANY_THROW(write_cloud("/proc/flowscope/a.ply", cloud));
}

}  // namespace
}  // namespace flowscope
