// A ring that is imported keeps its hole, as the simulator sees it.
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <array>
#include <fstream>
#include <numbers>

#include "recorder/mesh/mesh_object.h"
#include "render/mujoco_owners.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

using Eigen::Vector3d;

TEST(ImportedRings, FallOverAPeg) {
  const testing::TemporaryFolder folder;
  const Eigen::Matrix3d flat = Eigen::AngleAxisd(std::numbers::pi / 2, Vector3d::UnitX()).toRotationMatrix();
  TriangleMesh standing = testing::ring(48, 0.05, 48, 0.03, 0.01);
  for (Vector3d& v : standing.vertices) v = flat * v;  // as it may be modelled: its hole along y
  struct Case {
    const char* name;
    TriangleMesh mesh;
    double peg;  ///< radius, metres
    bool on_edge;
  };
  const std::vector<Case> cases{{"washer", testing::ring(24, 0.05, 24, 0.03, 0.01), 0.025, false},
                                {"nut", testing::ring(6, 0.02, 24, 0.010, 0.015), 0.008, false},
                                {"octagon", testing::ring(8, 0.1, 8, 0.07, 0.02), 0.055, false},
                                {"standing", standing, 0.025, true}};
  for (const Case& one : cases) {
    ObjectOptions options;
    options.name = one.name;
    write_object(one.mesh, options, folder.path() / "objects");
    const auto scene = folder.path() / "objects" / (std::string(one.name) + "_scene.xml");
    std::ofstream(scene) << "<mujoco><option timestep='0.0025' cone='elliptic' impratio='5'/><include file='"
                         << one.name
                         << ".xml'/><worldbody><geom type='box' size='.5 .5 .02' pos='0 0 -.02'/>"
                            "<geom type='cylinder' pos='0 0 .03' size='"
                         << one.peg << " .03'/></worldbody></mujoco>";
    std::array<char, 500> error{};
    const ModelPtr model(mj_loadXML(scene.c_str(), nullptr, error.data(), 500));
    ASSERT_TRUE(model) << one.name << ": " << error.data();
    const DataPtr data(mj_makeData(model.get()));
    data->qpos[2] = 0.065;
    if (one.on_edge) {
      // Turned back by its own origin, which lies below its middle.
      mju_axisAngle2Quat(data->qpos + 3, std::array<double, 3>{1, 0, 0}.data(), std::numbers::pi / 2);
      data->qpos[1] = 0.05;
      data->qpos[2] = 0.07;
    }
    const double start = data->qpos[2];
    for (int i = 0; i < 1200; ++i) mj_step(model.get(), data.get());
    EXPECT_LT(data->qpos[2], start - 0.055) << one.name << " hangs on the peg";
    EXPECT_GT(data->qpos[2], -0.003) << one.name;
    EXPECT_LT(mju_norm(data->qvel, 6), 0.05) << one.name << " does not rest";
  }
}

}  // namespace
}  // namespace flowscope
