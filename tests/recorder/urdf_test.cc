// URDF files as ROS packages have them: meshes of every kind, found where they are named; and what is wrong
// with one is told at its own line.
#include "recorder/urdf.h"

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <array>
#include <fstream>

#include "recorder/scene_task.h"
#include "render/mujoco_owners.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

const std::filesystem::path kAssets = FLOWSCOPE_SOURCE_DIR "/assets";
const std::string kTetrahedron =
    "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";

/// A tetrahedron of legs 0.1 x 0.2 x 0.3 units along x, y and z, with as many materials as colours.
std::string collada(const std::vector<std::string>& colors, const std::string& asset) {
  std::string effects, materials, binds, triangles;
  const std::vector<std::string> faces{"0 2 1", "0 1 3", "1 2 3", "2 0 3"};
  const std::size_t parts = std::max<std::size_t>(colors.size(), 1);
  for (std::size_t i = 0; i < parts; ++i) {
    const std::string id = "m" + std::to_string(i);
    std::string name;
    if (!colors.empty()) {
      effects += "<effect id='e" + id + "'><profile_COMMON><technique sid='c'><lambert><diffuse><color>" +
                 colors[i] + "</color></diffuse></lambert></technique></profile_COMMON></effect>";
      materials += "<material id='" + id + "'><instance_effect url='#e" + id + "'/></material>";
      binds += "<instance_material symbol='" + id + "' target='#" + id + "'/>";
      name = " material='" + id + "'";
    }
    std::string corners;
    int count = 0;
    for (std::size_t k = i; k < faces.size(); k += parts, ++count) corners += faces[k] + " ";
    triangles += "<triangles count='" + std::to_string(count) + "'" + name +
                 "><input semantic='VERTEX' source='#v' offset='0'/><p>" + corners + "</p></triangles>";
  }
  return "<?xml version='1.0'?><COLLADA xmlns='http://www.collada.org/2005/11/COLLADASchema' version='1.4.1'>"
         "<asset>" +
         asset + "</asset><library_effects>" + effects + "</library_effects><library_materials>" + materials +
         "</library_materials><library_geometries><geometry id='g'><mesh><source id='p'>"
         "<float_array id='a' count='12'>0 0 0 0.1 0 0 0 0.2 0 0 0 0.3</float_array><technique_common>"
         "<accessor source='#a' count='4' stride='3'><param name='X' type='float'/><param name='Y' "
         "type='float'/><param name='Z' type='float'/></accessor></technique_common></source>"
         "<vertices id='v'><input semantic='POSITION' source='#p'/></vertices>" +
         triangles +
         "</mesh></geometry></library_geometries><library_visual_scenes><visual_scene id='s'><node>"
         "<instance_geometry url='#g'><bind_material><technique_common>" +
         binds +
         "</technique_common></bind_material></instance_geometry></node></visual_scene></"
         "library_visual_scenes>"
         "<scene><instance_visual_scene url='#s'/></scene></COLLADA>";
}
const std::string kMetres = "<unit name='meter' meter='1'/><up_axis>Z_UP</up_axis>";

class Urdf : public ::testing::Test {
 protected:
  std::string file(const std::string& name, const std::string& text) const {
    const auto path = folder_.path() / name;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path, std::ios::binary) << text;
    return path.string();
  }
  static std::string shape(const std::string& kind, const std::string& mesh, const std::string& rest = "") {
    return "<" + kind + "><geometry><mesh filename=\"" + mesh + "\"/></geometry>" + rest + "</" + kind + ">";
  }
  /// One link with these shapes, each on a line of its own from line 2 on.
  std::string urdf(const std::vector<std::string>& shapes, const std::string& more = "") const {
    std::string text = "<robot name='r'>" + more + "<link name='l'>";
    for (const auto& one : shapes) text += "\n" + one;
    return file("package/urdf/r.urdf", text + "</link></robot>");
  }
  static std::shared_ptr<const Task> open(const std::string& scene) {
    return open_scene({scene, "", ""}, kAssets);
  }
  static std::string complaint(const std::string& scene) {
    try {
      open(scene);
    } catch (const BadScript& error) {
      return error.what();
    }
    return "";
  }
  testing::TemporaryFolder folder_;
};

#define EXPECT_BEGINS(text, start) EXPECT_EQ((text).rfind((start), 0), 0u) << (text)
#define EXPECT_HAS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

/// Whole sides of a geom's mesh, as it stands in the world; the smallest first.
Eigen::Vector3d sides(const mjModel* model, int geom) {
  const DataPtr data(mj_makeData(model));
  mj_kinematics(model, data.get());
  const int mesh = model->geom_dataid[geom];
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1e9), high = -low;
  for (int i = 0; i < model->mesh_vertnum[mesh]; ++i) {
    const float* v = model->mesh_vert + 3 * (model->mesh_vertadr[mesh] + i);
    const mjtNum local[3] = {v[0], v[1], v[2]};
    Eigen::Vector3d at;
    mju_rotVecMat(at.data(), local, data->geom_xmat + 9 * geom);
    low = low.cwiseMin(at);
    high = high.cwiseMax(at);
  }
  return high - low;
}

std::array<float, 3> rgb(const mjModel* model, int geom) {
  const float* rgba = model->geom_rgba + 4 * geom;
  return {rgba[0], rgba[1], rgba[2]};
}

TEST_F(Urdf, ColladaIsShownWithItsColoursAndSize) {
  file("package/meshes/one.dae", collada({"1 0 0 1"}, kMetres));
  file("package/meshes/two.DAE", collada({"1 0 0 1", "0 0 1 1"}, kMetres));
  file("package/meshes/none.dae", collada({}, "<unit meter='0.01'/><up_axis>Y_UP</up_axis>"));
  const std::string grey = "<material name='grey'><color rgba='0.25 0.25 0.25 1'/></material>";
  const auto task = open(urdf({shape("visual", "package://package/meshes/one.dae", grey),
                               shape("visual", "package://package/meshes/two.DAE", grey),
                               shape("visual", "../meshes/none.dae", grey),
                               shape("collision", "package://package/meshes/one.dae")}));
  const mjModel* model = task->model();
  ASSERT_EQ(model->ngeom, 4);
  EXPECT_EQ(rgb(model, 0), (std::array<float, 3>{1, 0, 0})) << "its own";
  ASSERT_GE(model->geom_matid[1], 0);
  EXPECT_GE(model->mat_texid[model->geom_matid[1]], 0) << "two colours are a picture";
  EXPECT_EQ(rgb(model, 2), (std::array<float, 3>{0.25, 0.25, 0.25})) << "it has none: the URDF's";
  const Eigen::Vector3d metres(0.1, 0.2, 0.3);
  for (const int geom : {0, 1, 3}) EXPECT_LT((sides(model, geom) - metres).norm(), 1e-5) << geom;
  EXPECT_LT((sides(model, 2) - 0.01 * metres).norm(), 1e-5) << "centimetres; and the axes are the file's";
  EXPECT_LE(model->geom_group[0], 2);
  EXPECT_EQ(model->geom_group[3], 3) << "what collides would hide what is to be seen";
  EXPECT_NE(model->geom_contype[3], 0);
}

TEST_F(Urdf, OtherKindsOfMeshesToo) {
  file("package/meshes/a.OBJ", kTetrahedron);
  file("package/meshes/red.obj", "mtllib red.mtl\nusemtl red\n" + kTetrahedron);
  file("package/meshes/red.mtl", "newmtl red\nKd 1 0 0\n");
  file("package/meshes/words.stl",
       "solid x\nfacet normal 0 0 -1\nouter loop\nvertex 0 0 0\nvertex 0 1 0\nvertex 1 0 "
       "0\nendloop\nendfacet\n"
       "facet normal 0 -1 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 0 1\nendloop\nendfacet\n"
       "facet normal 1 1 1\nouter loop\nvertex 1 0 0\nvertex 0 1 0\nvertex 0 0 1\nendloop\nendfacet\n"
       "facet normal -1 0 0\nouter loop\nvertex 0 1 0\nvertex 0 0 0\nvertex 0 0 1\nendloop\nendfacet\n"
       "endsolid x\n");
  file("package/meshes/b.ply",
       "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
       "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 4\n"
       "property list uchar int vertex_indices\nend_header\n0 0 0 0 255 0\n1 0 0 0 255 0\n0 1 0 0 255 0\n"
       "0 0 1 0 255 0\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n");
  const auto task = open(urdf({shape("visual", "../meshes/a.OBJ"), shape("visual", "../meshes/red.obj"),
                               shape("visual", "../meshes/words.stl"), shape("visual", "../meshes/b.ply")}));
  const mjModel* model = task->model();
  ASSERT_EQ(model->ngeom, 4) << "several visual shapes and no mass";
  EXPECT_EQ(rgb(model, 1), (std::array<float, 3>{1, 0, 0}));
  EXPECT_EQ(rgb(model, 3), (std::array<float, 3>{0, 1, 0}));
}

TEST_F(Urdf, TwoFilesOfOneNameStayTwo) {
  std::string small = kTetrahedron;
  for (auto at = small.find("0.1"); at != std::string::npos; at = small.find("0.1"))
    small.replace(at, 3, "0.05");
  file("package/meshes/visual/link.obj", kTetrahedron);
  file("package/meshes/collision/link.obj", small);
  for (const std::string more :
       {"", "<mujoco><compiler discardvisual='false' strippath='false'/></mujoco>"}) {
    const auto task = open(urdf({shape("visual", "package://package/meshes/visual/link.obj"),
                                 shape("collision", "package://package/meshes/collision/link.obj")},
                                more));
    EXPECT_NEAR(sides(task->model(), 0).x(), 0.1, 1e-6) << more;
    EXPECT_NEAR(sides(task->model(), 1).x(), 0.05, 1e-6) << more;
  }
}

TEST_F(Urdf, OneFileMayStandInManyScales) {
  file("package/meshes/link.obj", kTetrahedron);
  file("package/meshes/part.dae", collada({"1 0 0 1", "0 0 1 1"}, kMetres));
  for (const auto& [mesh, side] : {std::pair{"link.obj", 0.1}, {"part.dae", 0.1}}) {
    std::vector<std::string> shapes;
    const std::vector<int> scales{1, 2, 3, 2, 3, 1};
    for (const int scale : scales) {
      const std::string k = std::to_string(scale);
      shapes.push_back("<visual><geometry><mesh filename='../meshes/" + std::string(mesh) + "' scale='" + k +
                       " " + k + " " + k + "'/></geometry></visual>");
    }
    const auto task = open(urdf(shapes));
    ASSERT_EQ(task->model()->ngeom, 6);
    for (int i = 0; i < 6; ++i)
      EXPECT_NEAR(sides(task->model(), i).x(), side * scales[static_cast<std::size_t>(i)], 1e-6) << mesh << i;
  }
}

TEST_F(Urdf, MeshesAreFoundByEveryKindOfName) {
  const std::string mesh = file("package/meshes/a part &1.obj", kTetrahedron);
  file("package/urdf/beside.obj", kTetrahedron);
  for (const std::string& name :
       {std::string("package://package/meshes/a part &amp;1.obj"),
        std::string("package://package/meshes/a%20part%20&amp;1.obj"),
        std::string("model://package/meshes/a part &amp;1.obj"),
        "file://" + folder_.path().string() + "/package/meshes/a part &amp;1.obj",
        std::string("../meshes/a part &amp;1.obj"), std::string("package://elsewhere/meshes/beside.obj")}) {
    for (const std::string more : {"", "<mujoco><compiler discardvisual='false'/></mujoco>"}) {
      const std::string scene = urdf({shape("visual", name)}, more);
      EXPECT_EQ(complaint(scene), "") << name;
      EXPECT_EQ(open(scene)->model()->nmesh, 1) << name;
    }
  }
}

TEST_F(Urdf, EveryMissingMeshIsNamedAndNoOther) {
  file("package/meshes/there.obj", kTetrahedron);
  const std::string scene =
      urdf({shape("visual", "package://package/meshes/there.obj"),
            shape("visual", "package://package/meshes/gone.stl"), shape("collision", "../meshes/lost.dae")});
  const std::string said = complaint(scene);
  EXPECT_BEGINS(said, scene + ":3: the mesh package://package/meshes/gone.stl is not there");
  EXPECT_HAS(said, "\n" + scene + ":4: the mesh ../meshes/lost.dae is not there");
  EXPECT_EQ(said.find("there.obj"), std::string::npos) << said;
}

TEST_F(Urdf, WhatIsWrongIsToldAtItsOwnLine) {
  file("package/meshes/broken.dae", "<COLLADA>");
  file("package/meshes/flat.stl", std::string(84, '\0'));
  const std::string joint = "<link name='m'/>\n<joint name='j' type='revolute'><parent link='l'/>";
  const std::pair<std::string, std::string> wrong[] = {
      {"\n" + joint + "<child link='no'/></joint>", "URDF joint parent or child missing"},
      {"\n" + joint + "</joint>", "missing element: 'child'"},
      {"\n" + joint + "<child link='m'/><axis xyz='0 0 0'/></joint>", "axis too small in joint 'j'"},
      {"\n" + joint + "<child link='m'/><limit lower='x'/></joint>", "problem reading attribute 'lower'"},
      {"\n<link name='m'/>\n<joint name='j' type='Revolute'><parent link='l'/><child link='m'/></joint>",
       "joint 'j' is of the unknown type 'Revolute'"},
      {"\n\n<link name='m'><visual><geometry><mesh "
       "filename='package/meshes/broken.dae'/></geometry></visual></link>",
       "broken.dae: "},
      {"\n\n<link name='m'><visual><geometry><mesh "
       "filename='package/meshes/flat.stl'/></geometry></visual></link>",
       "flat"},
      {"\n\n<link name='${prefix}m'/>", "run xacro first"},
      {"\n\n<xacro:include filename='x'/>", "run xacro first"},
      {"\n\n<link name='m'><inertial><mass value='$(arg m)'/></inertial></link>", "run xacro first"},
      {"\n\n<link name='m'", "is no valid XML"}};
  for (const auto& [text, what] : wrong) {
    const std::string scene = file("r.urdf",
                                   "<robot name='r' xmlns:xacro='x'><link name='l'><visual>"
                                   "<geometry><mesh filename='package/meshes/whole.obj'/></geometry>"
                                   "</visual></link>" +
                                       text + "</robot>");
    file("package/meshes/whole.obj", kTetrahedron);
    const std::string said = complaint(scene);
    EXPECT_BEGINS(said, scene + ":3: ");
    EXPECT_HAS(said, what);
  }
}

TEST_F(Urdf, WhatOthersReadMayHoldAnything) {
  const std::string scene =
      file("r.urdf",
           "<robot name='r'><link name='l'><visual><geometry><box size='1 1 1'/></geometry></visual>"
           "</link><gazebo><plugin filename='$(find x)'/></gazebo></robot>");
  EXPECT_EQ(complaint(scene), "");
}

}  // namespace
}  // namespace flowscope
