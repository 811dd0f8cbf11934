// Textures of mesh files, from the file to the picture that the simulator draws.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <numbers>

#include "recorder/mesh/mesh_object.h"
#include "recorder/mesh/mesh_skin.h"
#include "render/decode.h"
#include "render/encode.h"
#include "render/renderer.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/small_scene.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

using Eigen::Vector3d;
using Color = std::array<std::uint8_t, 3>;

constexpr Color red{220, 20, 20}, green{20, 200, 20}, blue{20, 20, 220}, yellow{220, 220, 20};

/// Red and green above, blue and yellow below.
ImageRgb four_colors(int side = 64) {
  ImageRgb image(side, side);
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) {
      const Color& color = y < side / 2 ? (x < side / 2 ? red : green) : (x < side / 2 ? blue : yellow);
      std::copy(color.begin(), color.end(), image.at(x, y));
    }
  return image;
}

ImageRgb plain(const Color& color) {
  ImageRgb image(8, 8);
  for (int i = 0; i < 64; ++i) std::copy(color.begin(), color.end(), image.at(i % 8, i / 8));
  return image;
}

/// A plate of 100 x 100 x 20 mm, textured from above: the picture's lower left corner lies at its origin.
TriangleMesh plate() { return testing::box({0.1, 0.1, 0.02}); }

std::string as_textured_obj(const std::string& library, double repeats = 1) {
  std::ostringstream text;
  text << "mtllib " << library << "\nusemtl skin\n";
  const TriangleMesh mesh = plate();
  for (const Vector3d& v : mesh.vertices) text << "v " << v.transpose() << '\n';
  for (const Vector3d& v : mesh.vertices)
    text << "vt " << v.x() * 10 * repeats << ' ' << v.y() * 10 * repeats << '\n';
  for (const auto& t : mesh.triangles) {
    text << 'f';
    for (const int k : t) text << ' ' << k + 1 << '/' << k + 1;
    text << '\n';
  }
  return text.str();
}

class MeshTexture : public ::testing::Test {
 protected:
  std::filesystem::path write(const std::string& name, const std::string& text) {
    std::filesystem::create_directories((folder_.path() / name).parent_path());
    std::ofstream(folder_.path() / name, std::ios::binary) << text;
    return folder_.path() / name;
  }
  std::filesystem::path obj(const std::string& name, const std::string& picture, double repeats = 1) {
    write(name + ".mtl", "newmtl skin\nKd 0.5 0.25 0\nmap_Kd " + picture + "\n");
    return write(name + ".obj", as_textured_obj(name + ".mtl", repeats));
  }
  TriangleMesh read(const std::filesystem::path& file) {
    MeshImportOptions options;
    options.leave_out = [this](const std::string& what) { left_out_.push_back(what); };
    return read_mesh(file, options);
  }
  /// The object from above, 64 pixels for 120 mm.
  ImageRgb picture(const TriangleMesh& mesh, const std::string& name) {
    ObjectOptions options;
    options.name = name;
    report_ = write_object(mesh, options, folder_.path() / "objects");
    std::array<char, 500> error{};
    const ModelPtr model(mj_loadXML(report_.file.c_str(), nullptr, error.data(), 500));
    if (!model) throw std::runtime_error(error.data());
    Renderer renderer(model.get(), name, {64, 64, 0, false});
    const Pose above{{0, 0, 0.62},
                     Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi, Vector3d::UnitX()))};
    CameraModel camera = CameraModel::from_vertical_fov("above", 64, 64, 0.2, above);
    camera.far_m = 2;
    return renderer.draw(testing::initial_state(model.get(), name), camera);
  }
  /// What is drawn at a place of the plate's top, each coordinate within 50 mm.
  static Color at(const ImageRgb& picture, double x_mm, double y_mm) {
    const auto* pixel =
        picture.at(static_cast<int>(32 + x_mm * 64 / 120), static_cast<int>(32 - y_mm * 64 / 120));
    return {pixel[0], pixel[1], pixel[2]};
  }
  /// The same hue; light and shade may change how bright it is.
  static void expect_like(const Color& seen, const Color& wanted, const char* where) {
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_EQ(seen[c] > 40, wanted[c] > 40)
          << where << ": " << int(seen[0]) << ' ' << int(seen[1]) << ' ' << int(seen[2]);
    }
  }
  static void expect_four_colors(const ImageRgb& seen) {
    expect_like(at(seen, -25, 25), red, "upper left");
    expect_like(at(seen, 25, 25), green, "upper right");
    expect_like(at(seen, -25, -25), blue, "lower left");
    expect_like(at(seen, 25, -25), yellow, "lower right");
  }

  testing::TemporaryFolder folder_;
  std::vector<std::string> left_out_;
  ObjectReport report_;
};

TEST_F(MeshTexture, OfAnObjFileIsDrawnTheRightWayRound) {
  write_png(folder_.path() / "skin.png", four_colors());
  const TriangleMesh mesh = read(obj("plate", "skin.png"));
  EXPECT_TRUE(left_out_.empty()) << left_out_.front();
  ASSERT_EQ(mesh.textures.size(), 1u);
  EXPECT_EQ(mesh.textures[0], four_colors());
  expect_four_colors(picture(mesh, "plate"));
  EXPECT_EQ(report_.textures, 1u);
  EXPECT_EQ(report_.colors, 0u);
  EXPECT_TRUE(std::filesystem::exists(folder_.path() / "objects" / "plate_colors.png"));
}

TEST_F(MeshTexture, MayBeAJpegInAFolderBelowWithAForeignPath) {
  JpegEncoder jpeg;
  const auto bytes = jpeg.encode(four_colors(), 95);
  write("maps/my skin.jpg", {bytes.begin(), bytes.end()});
  expect_four_colors(picture(read(obj("below", "maps/my%20skin.jpg")), "below"));
  write("skin.jpg", {bytes.begin(), bytes.end()});
  expect_four_colors(picture(read(obj("foreign", "C:\\models\\skin.jpg")), "foreign"));
  EXPECT_TRUE(left_out_.empty()) << left_out_.front();
}

TEST_F(MeshTexture, IsRepeatedWhereTheMeshSaysSo) {
  write_png(folder_.path() / "skin.png", four_colors());
  const TriangleMesh twice = read(obj("twice", "skin.png", 2));
  const ImageRgb alone = picture(twice, "alone");
  // The same beside another texture: both in one picture.
  TriangleMesh both = twice;
  write_png(folder_.path() / "green.png", plain(green));
  TriangleMesh other = read(obj("other", "green.png"));
  for (Vector3d& v : other.vertices) v.z() -= 0.05;
  append(both, other);
  const ImageRgb together = picture(both, "both");
  EXPECT_EQ(report_.textures, 2u);
  for (const ImageRgb* seen : {&alone, &together}) {
    for (const double x : {-37.5, 12.5})
      for (const double y : {-37.5, 12.5}) {
        expect_like(at(*seen, x, y + 25), red, "red of a quarter");
        expect_like(at(*seen, x + 25, y + 25), green, "green of a quarter");
        expect_like(at(*seen, x, y), blue, "blue of a quarter");
        expect_like(at(*seen, x + 25, y), yellow, "yellow of a quarter");
      }
  }
}

TEST_F(MeshTexture, StandsBesidePlainColours) {
  write_png(folder_.path() / "skin.png", four_colors());
  TriangleMesh mesh = read(obj("plate", "skin.png"));
  TriangleMesh bar = testing::box({0.02, 0.02, 0.04});
  bar.colors.assign(bar.triangles.size(), {200, 30, 200});
  for (Vector3d& v : bar.vertices) v += Vector3d(0.04, 0.04, 0);  // in the middle of the plate
  append(mesh, bar);
  const ImageRgb seen = picture(mesh, "both");
  EXPECT_EQ(report_.textures, 1u);
  EXPECT_EQ(report_.colors, 1u);
  expect_four_colors(seen);
  expect_like(at(seen, 0, 0), {200, 30, 200}, "the bar");
}

TEST_F(MeshTexture, ThatCanNotBeReadIsToldAndLeavesThePlainColour) {
  const auto complaint = [&](const std::filesystem::path& file) {
    left_out_.clear();
    const TriangleMesh mesh = read(file);
    EXPECT_TRUE(mesh.textures.empty());
    EXPECT_EQ(mesh.texture_of.front(), -1);
    EXPECT_NEAR(mesh.colors.front()[0], 127.5, 1.5);
    return left_out_.size() == 1 ? left_out_.front() : "told " + std::to_string(left_out_.size()) + " times";
  };
  const auto expect_told = [&](const std::string& said, const std::string& words) {
    EXPECT_NE(said.find(words), std::string::npos) << said;
  };
  expect_told(complaint(obj("a", "none.png")), "a.obj: its texture 'none.png' is not there");
  expect_told(complaint(obj("b", "https://example.org/skin.png")), "only files beside the mesh");
  write_png(folder_.path() / "secret.png", four_colors());
  expect_told(complaint(obj("inner/c", "../secret.png")), "only files beside the mesh");
  write("noise.png", "this is no picture, whatever its name says");
  expect_told(complaint(obj("d", "noise.png")), "neither PNG nor JPEG");
  const auto bytes = encode_png(four_colors());
  std::string cut(bytes.begin(), bytes.begin() + 60);
  write("cut.png", cut);
  expect_told(complaint(obj("e", "cut.png")), "can not be decoded");
  cut[16] = 0x7F;  // the width that its header claims
  write("wide.png", cut);
  expect_told(complaint(obj("f", "wide.png")), "at most 8192 a side");
  // A pipe would keep its reader waiting.
  std::filesystem::create_directory(folder_.path() / "folder.png");
  expect_told(complaint(obj("g", "folder.png")), "is not there");
}

TEST_F(MeshTexture, OfTheFileItselfIsMultipliedByTheBaseColour) {
  // As glTF: y up, v down, colours in linear light.
  const TriangleMesh mesh = plate();
  std::string bytes;
  const auto put = [&](auto value) { bytes.append(reinterpret_cast<const char*>(&value), sizeof value); };
  for (const Vector3d& v : mesh.vertices) put(float(v.x())), put(float(v.z())), put(float(-v.y()));
  for (const Vector3d& v : mesh.vertices) put(float(10 * v.x())), put(float(1 - 10 * v.y()));
  for (const auto& t : mesh.triangles)
    for (const int k : t) put(static_cast<std::uint32_t>(k));
  const std::size_t places = bytes.size();
  const auto png = encode_png(four_colors());
  bytes.append(png.begin(), png.end());
  write("plate.bin", bytes);
  const auto n = mesh.vertices.size(), m = 3 * mesh.triangles.size();
  std::ostringstream text;
  text
      << R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"meshes":[{"primitives":[)"
      << R"({"attributes":{"POSITION":0,"TEXCOORD_0":1},"indices":2,"material":0}]}],"materials":[{"pbrMetallicRoughness":)"
      << R"({"baseColorFactor":[1,0.2140411,1,1],"baseColorTexture":{"index":0}}}],"textures":[{"source":0}],)"
      << R"("images":[{"bufferView":3,"mimeType":"image/png"}],"accessors":[{"bufferView":0,"componentType":5126,"count":)"
      << n
      << R"(,"type":"VEC3","min":[0,0,-0.1],"max":[0.1,0.02,0]},{"bufferView":1,"componentType":5126,"count":)"
      << n << R"(,"type":"VEC2"},{"bufferView":2,"componentType":5125,"count":)" << m
      << R"(,"type":"SCALAR"}],"bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":)" << 12 * n
      << R"(},{"buffer":0,"byteOffset":)" << 12 * n << R"(,"byteLength":)" << 8 * n
      << R"(},{"buffer":0,"byteOffset":)" << 20 * n << R"(,"byteLength":)" << 4 * m
      << R"(},{"buffer":0,"byteOffset":)" << places << R"(,"byteLength":)" << png.size()
      << R"(}],"buffers":[{"byteLength":)" << bytes.size() << R"(,"uri":"plate.bin"}]})";
  const TriangleMesh read_back = read(write("plate.gltf", text.str()));
  EXPECT_TRUE(left_out_.empty()) << left_out_.front();
  ASSERT_EQ(read_back.textures.size(), 1u);
  EXPECT_NEAR(read_back.textures[0].at(63, 0)[1], 100 * 200.0 / 200, 14) << "half as bright as is shown";
  EXPECT_EQ(read_back.textures[0].at(0, 0)[0], red[0]);
  expect_four_colors(picture(read_back, "plate"));
}

TEST_F(MeshTexture, LargePicturesAreMadeSmaller) {
  write_png(folder_.path() / "large.png", four_colors(3000));
  const TriangleMesh mesh = read(obj("large", "large.png"));
  ASSERT_EQ(mesh.textures.size(), 1u);
  EXPECT_EQ(mesh.textures[0].width, 2048);
  EXPECT_EQ(mesh.textures[0].at(2000, 2000)[0], yellow[0]);
}

}  // namespace
}  // namespace flowscope
