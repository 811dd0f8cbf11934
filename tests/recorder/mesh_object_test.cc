// Mesh files of five formats as objects of the simulator.
#include "recorder/mesh/mesh_object.h"

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <array>
#include <cstring>
#include <fstream>
#include <limits>

#include "recorder/mesh/convex_hull.h"
#include "recorder/mesh/mesh_picture.h"
#include "recorder/scene_files.h"
#include "recorder/task.h"
#include "render/mujoco_owners.h"
#include "render/renderer.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

using Eigen::Vector3d;
using testing::as_obj;

/// As STL: no shared corners, a normal per face that nobody reads.
std::string as_stl(const TriangleMesh& mesh) {
  std::ostringstream text;
  text << "solid thing\n";
  for (const auto& t : mesh.triangles) {
    text << "facet normal 0 0 0\nouter loop\n";
    for (const int k : t) text << "vertex " << mesh.vertices[static_cast<std::size_t>(k)].transpose() << '\n';
    text << "endloop\nendfacet\n";
  }
  return text.str() + "endsolid thing\n";
}

/// As PLY, every corner red or blue by its x.
std::string as_ply(const TriangleMesh& mesh) {
  std::ostringstream text;
  text << "ply\nformat ascii 1.0\nelement vertex " << mesh.vertices.size()
       << "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar "
          "green\nproperty uchar blue\n"
       << "element face " << mesh.triangles.size()
       << "\nproperty list uchar int vertex_indices\nend_header\n";
  for (const Vector3d& v : mesh.vertices)
    text << v.transpose() << (v.x() > 0.05 ? " 255 0 0\n" : " 0 0 255\n");
  for (const auto& t : mesh.triangles) text << "3 " << t[0] << ' ' << t[1] << ' ' << t[2] << '\n';
  return text.str();
}

std::string base64(const std::vector<std::uint8_t>& bytes) {
  static const char* letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const auto at = [&](std::size_t k) { return k < bytes.size() ? bytes[k] : std::uint8_t{0}; };
    const unsigned word =
        static_cast<unsigned>(at(i)) << 16 | static_cast<unsigned>(at(i + 1)) << 8 | at(i + 2);
    for (int k = 0; k < 4; ++k)
      text += i + static_cast<std::size_t>(k) > bytes.size() ? '=' : letters[word >> (18 - 6 * k) & 63];
  }
  return text;
}

/// As glTF with its buffer inside: y up, as the format wants it.
std::string as_gltf(const TriangleMesh& mesh) {
  std::vector<std::uint8_t> bytes;
  const auto put = [&](const auto& value) {
    const auto* raw = reinterpret_cast<const std::uint8_t*>(&value);
    bytes.insert(bytes.end(), raw, raw + sizeof value);
  };
  for (const Vector3d& v : mesh.vertices) put(float(v.x())), put(float(v.z())), put(float(-v.y()));
  for (const auto& t : mesh.triangles)
    for (const int k : t) put(static_cast<std::uint32_t>(k));
  const auto n = mesh.vertices.size(), m = 3 * mesh.triangles.size();
  const Extent e = extent_of(mesh.vertices);
  std::ostringstream text;
  text << R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
       << R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]}],)"
       << R"("materials":[{"pbrMetallicRoughness":{"baseColorFactor":[0.2140411,0,0,1]}}],)"
       << R"("accessors":[{"bufferView":0,"componentType":5126,"count":)" << n << R"(,"type":"VEC3","min":[)"
       << e.low.x() << ',' << e.low.z() << ',' << -e.high.y() << R"(],"max":[)" << e.high.x() << ','
       << e.high.z() << ',' << -e.low.y() << R"(]},{"bufferView":1,"componentType":5125,"count":)" << m
       << R"(,"type":"SCALAR"}],)"
       << R"("bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":)" << 12 * n
       << R"(},{"buffer":0,"byteOffset":)" << 12 * n << R"(,"byteLength":)" << 4 * m
       << R"(}],"buffers":[{"byteLength":)" << bytes.size()
       << R"(,"uri":"data:application/octet-stream;base64,)" << base64(bytes) << R"("}]})";
  return text.str();
}

/// As COLLADA in centimetres with z up.
std::string as_dae(const TriangleMesh& mesh) {
  std::ostringstream text;
  text
      << R"(<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset>)"
      << R"(<unit name="centimeter" meter="0.01"/><up_axis>Z_UP</up_axis></asset><library_geometries><geometry id="g">)"
      << R"(<mesh><source id="p"><float_array id="a" count=")" << 3 * mesh.vertices.size() << "\">";
  for (const Vector3d& v : mesh.vertices)
    text << 100 * v.x() << ' ' << 100 * v.y() << ' ' << 100 * v.z() << ' ';
  text
      << R"(</float_array><technique_common><accessor source="#a" count=")" << mesh.vertices.size()
      << R"(" stride="3"><param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>)"
      << R"(</accessor></technique_common></source><vertices id="v"><input semantic="POSITION" source="#p"/></vertices>)"
      << "<triangles count=\"" << mesh.triangles.size()
      << R"("><input semantic="VERTEX" source="#v" offset="0"/><p>)";
  for (const auto& t : mesh.triangles) text << t[0] << ' ' << t[1] << ' ' << t[2] << ' ';
  text
      << R"(</p></triangles></mesh></geometry></library_geometries><library_visual_scenes><visual_scene id="s"><node>)"
      << R"(<instance_geometry url="#g"/></node></visual_scene></library_visual_scenes><scene>)"
      << R"(<instance_visual_scene url="#s"/></scene></COLLADA>)";
  return text.str();
}

class Objects : public ::testing::Test {
 protected:
  std::filesystem::path write(const std::string& name, const std::string& text) {
    const auto file = folder_.path() / name;
    std::ofstream(file, std::ios::binary) << text;
    return file;
  }
  ObjectReport object(const TriangleMesh& mesh, const std::string& name, ObjectOptions options = {}) {
    options.name = name;
    return write_object(mesh, options, folder_.path() / "objects");
  }
  std::string complaint(const std::string& name, const std::string& text) {
    try {
      read_mesh(write(name, text), {});
    } catch (const BadMesh& error) {
      return error.what();
    }
    return "accepted";
  }
  static ModelPtr compile(const std::filesystem::path& file) {
    char error[500] = "";
    ModelPtr model(mj_loadXML(file.c_str(), nullptr, error, sizeof error));
    EXPECT_TRUE(model) << error;
    return model;
  }
  /// Extent of the geoms of a group as the simulator has them, metres.
  static Extent extent(const mjModel* model, int group) {
    const DataPtr data(mj_makeData(model));
    mj_kinematics(model, data.get());
    std::vector<Vector3d> points;
    for (int g = 0; g < model->ngeom; ++g) {
      if (model->geom_group[g] != group) continue;
      const int mesh = model->geom_dataid[g];
      const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> turn(data->geom_xmat + 9 * g);
      const Eigen::Map<const Vector3d> at(data->geom_xpos + 3 * g);
      if (model->geom_type[g] == mjGEOM_BOX) {
        const Eigen::Map<const Vector3d> half(model->geom_size + 3 * g);
        for (int corner = 0; corner < 8; ++corner)
          points.push_back(at + turn * half.cwiseProduct(Vector3d(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1,
                                                                  corner & 4 ? 1 : -1)));
        continue;
      }
      for (int v = 0; v < model->mesh_vertnum[mesh]; ++v) {
        const float* p = model->mesh_vert + 3 * (model->mesh_vertadr[mesh] + v);
        points.push_back(turn * Vector3d(p[0], p[1], p[2]) + at);
      }
    }
    return extent_of(points);
  }
  testing::TemporaryFolder folder_;
};

TEST_F(Objects, EveryFormatGivesTheSameThing) {
  const TriangleMesh shape = testing::l_shape();
  const Vector3d size(0.10, 0.03, 0.08);
  const std::vector<std::pair<std::string, std::string>> files{{"l.obj", as_obj(shape)},
                                                               {"l.stl", as_stl(shape)},
                                                               {"l.ply", as_ply(shape)},
                                                               {"l.gltf", as_gltf(shape)},
                                                               {"l.dae", as_dae(shape)}};
  for (const auto& [name, text] : files) {
    const std::string object_name = "from_" + name.substr(2);
    const ObjectReport report = object(read_mesh(write(name, text), {}), object_name);
    EXPECT_TRUE(report.closed) << name;
    EXPECT_EQ(report.parts, 2u) << name;
    EXPECT_NEAR(report.volume, 96e-6, 1e-9) << name;
    EXPECT_NEAR(report.parts_volume, 96e-6, 1e-9) << name;
    EXPECT_NEAR(report.mass_kg, 0.096, 1e-6) << name;
    EXPECT_LT((report.size - size).norm(), 1e-6) << name;
    const ModelPtr model = compile(report.file);
    ASSERT_TRUE(model) << name;
    for (const int group : {2, 3}) {
      const Extent e = extent(model.get(), group);
      EXPECT_LT((e.size() - size).cwiseAbs().maxCoeff(), 1e-4) << name << " group " << group;
      EXPECT_NEAR(e.low.z(), 0, 1e-4) << name;
      EXPECT_NEAR(e.low.x(), -0.05, 1e-4) << name;
    }
    EXPECT_NEAR(model->body_mass[1], 0.096, 1e-6);
    // Bars of 60 000 mm^3 around (50, 10) mm and 36 000 mm^3 around (10, 50) mm in x and z.
    const double x = (60e-6 * 0.05 + 36e-6 * 0.01) / 96e-6, z = (60e-6 * 0.01 + 36e-6 * 0.05) / 96e-6;
    EXPECT_NEAR(model->body_ipos[3], x - 0.05, 1e-5) << name;
    EXPECT_NEAR(model->body_ipos[5], z, 1e-5) << name;
    EXPECT_EQ(model->nq, 7);
  }
}

TEST_F(Objects, UnitsAndTheAxisThatPointsUp) {
  const auto file = write("box.obj", as_obj(testing::box({0.02, 0.03, 0.05}), 1000));
  const Extent mm = extent_of(read_mesh(file, {0.001, {}}).vertices);
  EXPECT_LT((mm.size() - Vector3d(0.02, 0.03, 0.05)).norm(), 1e-6);
  const Extent turned = extent_of(read_mesh(file, {0.001, 'y'}).vertices);
  EXPECT_LT((turned.size() - Vector3d(0.02, 0.05, 0.03)).norm(), 1e-6);
  EXPECT_THROW(object(read_mesh(file, {}), "huge"), BadMesh);
}

TEST_F(Objects, InertiaIsThatOfTheSolid) {
  ObjectOptions options;
  options.mass_kg = 3;
  const ObjectReport report = object(testing::box({0.2, 0.3, 0.5}), "block", options);
  const ModelPtr model = compile(report.file);
  ASSERT_TRUE(model);
  EXPECT_NEAR(model->body_mass[1], 3, 1e-9);
  std::array<double, 3> found{model->body_inertia[3], model->body_inertia[4], model->body_inertia[5]};
  std::sort(found.begin(), found.end());
  EXPECT_NEAR(found[0], 3 * (0.04 + 0.09) / 12, 1e-6);
  EXPECT_NEAR(found[1], 3 * (0.04 + 0.25) / 12, 1e-6);
  EXPECT_NEAR(found[2], 3 * (0.09 + 0.25) / 12, 1e-6);
}

TEST_F(Objects, AnOpenSurfaceWeighsWhatItsHullWould) {
  TriangleMesh lidless = testing::box({0.1, 0.1, 0.1});
  lidless.triangles.resize(10);
  const ObjectReport report = object(lidless, "lidless");
  EXPECT_FALSE(report.closed);
  EXPECT_NEAR(report.volume, 0.001, 1e-9);
}

TEST_F(Objects, ComeToRestOnATable) {
  for (const auto& [name, mesh] : {std::pair{"l", testing::l_shape()},
                                   {"cup", testing::cup()},
                                   {"ball", testing::sphere(0.03, 10, 16)}}) {
    const ObjectReport report = object(mesh, name);
    const auto scene = folder_.path() / "objects" / (std::string(name) + "_scene.xml");
    std::ofstream(scene)
        << "<mujoco><option timestep='0.0025' cone='elliptic' impratio='5'/><include file='" << name
        << ".xml'/><worldbody><geom type='box' size='.5 .5 .02' pos='0 0 -.02' friction='.9 .01 .001'/>"
           "</worldbody></mujoco>";
    const ModelPtr model = compile(scene);
    ASSERT_TRUE(model) << name;
    const DataPtr data(mj_makeData(model.get()));
    data->qpos[2] = 0.05;
    mju_axisAngle2Quat(data->qpos + 3, std::array<double, 3>{1, 0, 0}.data(),
                       std::string(name) == "cup" ? 0.1 : 0.3);
    double fastest = 0;
    for (int i = 0; i < 1600; ++i) {
      mj_step(model.get(), data.get());
      fastest = std::max(fastest, mju_norm3(data->qvel));
    }
    EXPECT_LT(fastest, 2.5) << name << " was thrown about";
    EXPECT_LT(std::hypot(data->qpos[0], data->qpos[1]), 0.25) << name;
    EXPECT_GT(data->qpos[2], -0.002) << name << " sank";
    if (std::string(name) == "ball") continue;
    EXPECT_LT(mju_norm(data->qvel, 6), 0.01) << name << " does not rest";
    for (int k = 0; k < mjNWARNING; ++k) EXPECT_EQ(data->warning[k].number, 0) << name << " warning " << k;
  }
}

TEST_F(Objects, ACupHoldsABall) {
  const ObjectReport report = object(testing::cup(), "mug");
  const auto scene = folder_.path() / "objects" / "mug_scene.xml";
  std::ofstream(scene)
      << "<mujoco><option timestep='0.0025' cone='elliptic' impratio='5'/><include "
         "file='mug.xml'/><worldbody>"
         "<geom type='box' size='.5 .5 .02' pos='0 0 -.02'/>"
         "<body name='marble' pos='0.005 0 0.12'><freejoint/><geom type='sphere' size='.012'/></body>"
         "</worldbody></mujoco>";
  const ModelPtr model = compile(scene);
  ASSERT_TRUE(model);
  const DataPtr data(mj_makeData(model.get()));
  for (int i = 0; i < 1200; ++i) mj_step(model.get(), data.get());
  EXPECT_NEAR(data->qpos[9], 0.018, 0.003) << "the marble lies on the floor of the cup";
}

TEST_F(Objects, ASceneIncludesTheFolderOfAnObject) {
  ObjectOptions options;
  options.name = "mug";
  write_object(testing::cup(), options, folder_.path() / "mug");
  const auto scene = write("scene.xml", "<mujoco><include file='mug/mug.xml'/></mujoco>");
  const ModelPtr model = SceneFiles(find_assets()).compile(scene);
  EXPECT_GE(mj_name2id(model.get(), mjOBJ_BODY, "mug"), 0);
  EXPECT_GE(model->nmesh, 2);
}

TEST_F(Objects, ColoursAreInThePicture) {
  TriangleMesh painted = testing::box({0.1, 0.1, 0.02});
  const std::array<std::array<std::uint8_t, 3>, 6> sides{
      {{200, 200, 200}, {0, 0, 255}, {255, 0, 0}, {0, 255, 0}, {255, 255, 0}, {255, 0, 255}}};
  for (std::size_t i = 0; i < painted.triangles.size(); ++i) painted.colors.push_back(sides[i / 2]);
  const ObjectReport report = object(painted, "painted");
  EXPECT_EQ(report.colors, 6u);
  const ModelPtr model = compile(report.file);
  ASSERT_TRUE(model);
  Renderer renderer(model.get(), "painted", {64, 64, 0, false});
  SceneState state;
  state.scene = "painted";
  state.qpos.assign(model->qpos0, model->qpos0 + model->nq);
  state.qvel.assign(6, 0);
  state.eq_active = {};
  state.mat_rgba.assign(model->mat_rgba, model->mat_rgba + 4 * model->nmat);
  const Pose above{{0, 0, 0.3}, Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi, Vector3d::UnitX()))};
  CameraModel camera = CameraModel::from_vertical_fov("above", 64, 64, 0.4, above);
  camera.far_m = 2;
  const ImageRgb picture = renderer.draw(state, camera);
  // Which colour is on top? The third of the prism's outline runs along the top.
  const auto* middle = picture.at(32, 32);
  EXPECT_GT(middle[0], middle[1] + 60);
  EXPECT_GT(middle[0], middle[2] + 60);
  // From +y: the back of the prism.
  const Eigen::Matrix3d turn = (Eigen::Matrix3d() << -1, 0, 0, 0, 0, -1, 0, -1, 0).finished();
  camera.world_from_camera = {{0, 0.3, 0.01}, Eigen::Quaterniond(turn)};
  const ImageRgb back = renderer.draw(state, camera);
  const auto* face = back.at(32, 32);
  EXPECT_GT(std::min(face[0], face[2]), face[1] + 40)
      << int(face[0]) << ' ' << int(face[1]) << ' ' << int(face[2]);
}

TEST_F(Objects, ColoursOfMaterialsAndVertices) {
  const TriangleMesh gltf = read_mesh(write("red.gltf", as_gltf(testing::box({0.1, 0.1, 0.1}))), {});
  EXPECT_NEAR(gltf.colors.at(0)[0], 127.5, 1.5) << "linear 0.214 is half of what is shown";
  EXPECT_EQ(gltf.colors.at(0)[1], 0);
  write("paint.mtl", "newmtl green\nKd 0 0.5 0\n");
  const TriangleMesh obj =
      read_mesh(write("paint.obj", "mtllib paint.mtl\nusemtl green\n" + as_obj(testing::box({1, 1, 1}))), {});
  EXPECT_NEAR(obj.colors.at(0)[1], 127.5, 1.5);
  const TriangleMesh ply = read_mesh(write("two.ply", as_ply(testing::box({0.1, 0.1, 0.1}))), {});
  int blue = 0, red = 0;
  for (const auto& c : ply.colors) blue += c[2] > 150, red += c[0] > 150;
  EXPECT_GT(blue, 0);
  EXPECT_GT(red, 0);
}

TEST_F(Objects, ComplaintsNameTheFileAndTheFault) {
  const std::string nan = "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  EXPECT_NE(complaint("a.xyz", "x").find("a.xyz: is no mesh file"), std::string::npos);
  EXPECT_NE(complaint("empty.obj", "").find("empty.obj: is empty"), std::string::npos);
  EXPECT_NE(complaint("points.obj", "v 0 0 0\nv 1 0 0\n").find("points.obj: "), std::string::npos);
  EXPECT_NE(complaint("nan.obj", nan).find("nan.obj: "), std::string::npos) << complaint("nan.obj", nan);
  EXPECT_NE(complaint("wild.obj", "v 0 0 0\nv 1 0 0\nf 1 2 9\n").find("wild.obj: "), std::string::npos);
  EXPECT_NE(complaint("noise.glb", "glTF\x02 this is noise").find("noise.glb: "), std::string::npos);
  EXPECT_NE(complaint("cut.dae", as_dae(testing::l_shape()).substr(0, 700)).find("cut.dae: "),
            std::string::npos);
  EXPECT_THROW(read_mesh(folder_.path() / "none.stl", {}), BadMesh);
  const TriangleMesh flat{{{0, 0, 0}, {0.1, 0, 0}, {0.1, 0.1, 0}, {0, 0.1, 0}}, {{0, 1, 2}, {0, 2, 3}}, {}};
  EXPECT_THROW(object(flat, "flat"), BadMesh);
  EXPECT_THROW(object(testing::box({1e-5, 1e-5, 1e-5}), "tiny"), BadMesh);
  EXPECT_THROW(object(testing::box({0.1, 0.1, 0.1}), "../evil"), std::invalid_argument);
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "objects" / "flat.xml"));
  object(testing::box({0.1, 0.1, 0.1}), "once");
  EXPECT_THROW(object(testing::box({0.1, 0.1, 0.1}), "once"), std::invalid_argument)
      << "nothing is overwritten";
}

TEST_F(Objects, BrokenFilesAreRefusedOrReadButNeverEndTheProgram) {
  const TriangleMesh shape = testing::l_shape();
  unsigned state = 11;
  const auto random = [&state](std::size_t below) {
    state = state * 1664525u + 1013904223u;
    return static_cast<std::size_t>(state >> 8) % below;
  };
  int refused = 0;
  for (const auto& [name, text] : {std::pair{"x.obj", as_obj(shape)},
                                   {"x.stl", as_stl(shape)},
                                   {"x.ply", as_ply(shape)},
                                   {"x.gltf", as_gltf(shape)},
                                   {"x.dae", as_dae(shape)}}) {
    for (int i = 0; i < 6; ++i) {
      std::string broken = text;
      for (std::size_t k = 0; k < 1 + random(4); ++k)
        broken[random(broken.size())] = static_cast<char>(random(256));
      if (i % 3 == 0) broken.resize(random(broken.size()) + 1);
      try {
        for (const Vector3d& v : read_mesh(write(name, broken), {}).vertices) ASSERT_TRUE(v.allFinite());
      } catch (const BadMesh&) {
        ++refused;
      }
    }
  }
  EXPECT_GT(refused, 3);
}

TEST_F(Objects, AFileMayNameOnlyItsNeighbours) {
  const auto inner = folder_.path() / "inner";
  std::filesystem::create_directories(inner);
  write("secret.mtl", "newmtl green\nKd 0 1 0\n");
  std::ofstream(inner / "thing.obj") << "mtllib ../secret.mtl\nusemtl green\n"
                                     << as_obj(testing::box({1, 1, 1}));
  const TriangleMesh mesh = read_mesh(inner / "thing.obj", {});
  EXPECT_FALSE(mesh.colors.at(0)[1] == 255 && mesh.colors.at(0)[0] == 0);
}

}  // namespace
}  // namespace flowscope
