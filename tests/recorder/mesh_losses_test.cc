// What OBJ and STL files carry beside their triangles is applied, or told.
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>

#include "recorder/mesh/mesh_import.h"
#include "render/encode.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

using Eigen::Vector3d;

class MeshLosses : public ::testing::Test {
 protected:
  std::filesystem::path write(const std::string& name, const std::string& text) {
    std::ofstream(folder_.path() / name, std::ios::binary) << text;
    return folder_.path() / name;
  }
  TriangleMesh read(const std::filesystem::path& file) {
    left_out_.clear();
    MeshImportOptions options;
    options.leave_out = [this](const std::string& what) { left_out_ += what + "\n"; };
    return read_mesh(file, options);
  }
  /// One triangle whose corners lie at (0.1, 0.2) in the picture.
  TriangleMesh obj(const std::string& material, const std::string& head = "mtllib skin.mtl\nusemtl skin\n") {
    write("skin.mtl", "newmtl skin\nKd 1 0 0\n" + material);
    return read(write("thing.obj", head + "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.1 0.2\nf 1/1 2/1 3/1\n"));
  }
  void expect_told(const std::string& words) {
    EXPECT_NE(left_out_.find(words), std::string::npos) << "'" << words << "' not in: " << left_out_;
  }
  testing::TemporaryFolder folder_;
  std::string left_out_;
};

TEST_F(MeshLosses, OptionsOfAnObjPictureAreApplied) {
  for (const char* name : {"skin.png", "my skin.png", "2.png"})
    write_png(folder_.path() / name, ImageRgb(4, 4));
  const auto place = [&](const std::string& line) {
    const TriangleMesh mesh = obj("map_Kd " + line + "\n");
    EXPECT_EQ(mesh.textures.size(), 1u) << line << left_out_;
    return mesh.texture_corners.at(0)[0];
  };
  EXPECT_LT((place("skin.png") - Eigen::Vector2f(0.1f, 0.2f)).norm(), 1e-6);
  EXPECT_LT((place("-s 4 2 1 -o 0.5 0 0 skin.png") - Eigen::Vector2f(0.9f, 0.4f)).norm(), 1e-6);
  EXPECT_LT((place("-o 0.5 -s 2 3 my skin.png") - Eigen::Vector2f(0.7f, 0.6f)).norm(), 1e-6);
  EXPECT_LT((place("-blendu on -s 2 2 2 2.png") - Eigen::Vector2f(0.2f, 0.4f)).norm(), 1e-6);
  EXPECT_EQ(left_out_, "");
  place("-clamp on -mm 0 1 skin.png");
  expect_told("map_Kd -clamp");
  expect_told("map_Kd -mm");
}

TEST_F(MeshLosses, OfObjMaterialsAreTold) {
  obj("", "mtllib gone.mtl\nusemtl skin\n");
  expect_told("thing.obj: its material file 'gone.mtl' is not there");
  obj("", "mtllib skin.mtl\nusemtl other\n");
  expect_told("its material 'other' is defined in no material file");
  obj("", "usemtl skin\n");
  expect_told("its material 'skin' is defined in no material file");
  obj("map_Bump bumps.png\nd 0.5\nmap_Kd -s 2 2 gone.png\n");
  expect_told("map_Bump");
  expect_told("see-through");
  expect_told("its texture 'gone.png' is not there");
  EXPECT_EQ(obj("").colors.at(0), (std::array<std::uint8_t, 3>{255, 0, 0}));
  EXPECT_EQ(left_out_, "");
  // By the path of another machine.
  EXPECT_EQ(obj("", "mtllib C:\\models\\skin.mtl\nusemtl skin\n").colors.at(0)[1], 0);
  EXPECT_EQ(left_out_, "");
}

std::string binary_stl(const TriangleMesh& mesh) {
  std::string text = "solid by a program that calls everything so";
  text.resize(80, ' ');
  const auto put = [&](auto value) { text.append(reinterpret_cast<const char*>(&value), sizeof value); };
  put(static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const auto& t : mesh.triangles) {
    for (int i = 0; i < 3; ++i) put(0.0f);
    for (const int v : t)
      for (int i = 0; i < 3; ++i) put(static_cast<float>(mesh.vertices[static_cast<std::size_t>(v)][i]));
    put(std::uint16_t{0});
  }
  return text;
}

std::string text_stl(const TriangleMesh& mesh) {
  std::ostringstream text;
  text << "SOLID Thing\n";
  for (const auto& t : mesh.triangles) {
    text << "FACET NORMAL 0 0 0\nOUTER LOOP\n";
    for (const int v : t) text << "VERTEX " << mesh.vertices[static_cast<std::size_t>(v)].transpose() << "\n";
    text << "ENDLOOP\nENDFACET\n";
  }
  return text.str() + "ENDSOLID Thing\n";
}

TEST_F(MeshLosses, StlFilesAreReadAsTheirWritersLeaveThem) {
  const TriangleMesh box = testing::box({0.1, 0.2, 0.3});
  const auto expect_box = [&](const std::string& text, const std::string& what) {
    const TriangleMesh mesh = read(write("box.stl", text));
    EXPECT_EQ(mesh.triangles.size(), 12u) << what;
    EXPECT_LT((extent_of(mesh.vertices).size() - Vector3d(0.1, 0.2, 0.3)).norm(), 1e-6) << what;
  };
  expect_box(binary_stl(box), "binary");
  EXPECT_EQ(left_out_, "");
  expect_box(binary_stl(box) + std::string(7, '\0'), "binary with zeros after its end");
  expect_box(binary_stl(box) + "made by a scanner", "binary with bytes after its end");
  expect_told("box.stl: the 17 bytes after its last triangle");
  expect_box(text_stl(box), "capitals");
  EXPECT_EQ(left_out_, "");
  expect_box(text_stl(box) + std::string("\n\n\0\0", 4), "text with zeros after its end");
  expect_box(text_stl(box) + "and then some", "text with words after its end");
  expect_told("the 13 bytes after its last triangle");
}

}  // namespace
}  // namespace flowscope
