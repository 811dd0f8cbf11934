// glTF files with what their writers really use: extensions, packed numbers, odd pictures.
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>

#include "recorder/mesh/mesh_import.h"
#include "render/encode.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

using Eigen::Vector3d;
using nlohmann::json;

std::string base64(const std::string& bytes) {
  static const char* letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const auto at = [&](std::size_t k) {
      return k < bytes.size() ? static_cast<std::uint8_t>(bytes[k]) : std::uint8_t{0};
    };
    const unsigned word =
        static_cast<unsigned>(at(i)) << 16 | static_cast<unsigned>(at(i + 1)) << 8 | at(i + 2);
    for (std::size_t k = 0; k < 4; ++k)
      text += i + k > bytes.size() ? '=' : letters[word >> (18 - 6 * k) & 63];
  }
  return text;
}

ImageRgb left_red_right_blue() {
  ImageRgb image(8, 8);
  for (int i = 0; i < 64; ++i) image.at(i % 8, i / 8)[i % 8 < 4 ? 0 : 2] = 255;
  return image;
}

std::string png_uri(const ImageRgb& image) {
  const auto png = encode_png(image);
  return "data:image/png;base64," + base64({png.begin(), png.end()});
}

/// A tetrahedron of 1 m along the axes, with texture coordinates.
class Gltf : public ::testing::Test {
 protected:
  Gltf() {
    document_ =
        json::parse(R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
      "meshes":[{"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":1},"indices":2,"material":0}]}],
      "materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],"textures":[{"source":0}]})");
    document_["images"] = {{{"uri", png_uri(left_red_right_blue())}}};
    add<float>("VEC3", 5126, {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1});
    add<float>("VEC2", 5126, {0.1f, 0.1f, 0.2f, 0.1f, 0.1f, 0.2f, 0.2f, 0.2f});
    add<std::uint16_t>("SCALAR", 5123, {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3});
  }
  /// One more accessor with a view of its own, every element on a boundary of four bytes.
  template <class T>
  std::size_t add(const char* type, int component, const std::vector<T>& values, bool normalized = false) {
    const std::size_t width = std::string(type) == "SCALAR" ? 1 : std::string(type) == "VEC2" ? 2 : 3;
    const std::size_t stride = width == 1 ? sizeof(T) : (width * sizeof(T) + 3) / 4 * 4;
    json view{{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", values.size() / width * stride}};
    if (width > 1) view["byteStride"] = stride;
    for (std::size_t i = 0; i < values.size() / width; ++i) {
      std::string element(stride, '\0');
      std::memcpy(element.data(), &values[i * width], width * sizeof(T));
      bytes_ += element;
    }
    bytes_.resize((bytes_.size() + 3) / 4 * 4);
    document_["bufferViews"].push_back(view);
    document_["accessors"].push_back({{"bufferView", document_["bufferViews"].size() - 1},
                                      {"componentType", component},
                                      {"count", values.size() / width},
                                      {"type", type},
                                      {"normalized", normalized}});
    return document_["accessors"].size() - 1;
  }
  json& primitive() { return document_["meshes"][0]["primitives"][0]; }
  json& texture_info() { return document_["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]; }

  TriangleMesh read(bool binary = false) {
    left_out_.clear();
    const auto file = folder_.path() / (binary ? "thing.glb" : "thing.gltf");
    json buffer{{"byteLength", bytes_.size()}};
    if (!binary) buffer["uri"] = "data:application/octet-stream;base64," + base64(bytes_);
    document_["buffers"] = {buffer};
    std::string text = document_.dump();
    if (binary) {
      text.resize((text.size() + 3) / 4 * 4, ' ');
      const auto chunk = [](const std::string& kind, const std::string& content) {
        const auto length = static_cast<std::uint32_t>(content.size());
        return std::string(reinterpret_cast<const char*>(&length), 4) + kind + content;
      };
      const std::string chunks = chunk("JSON", text) + chunk(std::string("BIN\0", 4), bytes_);
      const auto all = static_cast<std::uint32_t>(12 + chunks.size());
      text = std::string("glTF\2\0\0\0", 8) + std::string(reinterpret_cast<const char*>(&all), 4) + chunks;
    }
    std::ofstream(file, std::ios::binary) << text;
    MeshImportOptions options;
    options.leave_out = [this](const std::string& what) { left_out_ += what + "\n"; };
    return read_mesh(file, options);
  }
  std::string complaint() {
    try {
      read();
    } catch (const BadMesh& error) {
      return error.what();
    }
    return "accepted";
  }
  void expect_told(const std::string& words) {
    EXPECT_NE(left_out_.find(words), std::string::npos) << "'" << words << "' not in: " << left_out_;
  }
  /// Of the picture under the middle of the first triangle.
  static std::array<int, 3> color(const TriangleMesh& mesh) {
    const ImageRgb& image = mesh.textures.at(0);
    Eigen::Vector2f at(0, 0);
    for (const auto& corner : mesh.texture_corners.at(0)) at += corner / 3;
    at -= Eigen::Vector2f(at.array().floor());
    const auto* pixel = image.at(std::min(image.width - 1, static_cast<int>(at.x() * image.width)),
                                 std::min(image.height - 1, static_cast<int>((1 - at.y()) * image.height)));
    return {pixel[0], pixel[1], pixel[2]};
  }
  testing::TemporaryFolder folder_;
  json document_;
  std::string bytes_, left_out_;
};

constexpr std::array<int, 3> red{255, 0, 0}, blue{0, 0, 255};

TEST_F(Gltf, AsTextAndBinaryIsTheSame) {
  const TriangleMesh text = read(), binary = read(true);
  EXPECT_EQ(left_out_, "");
  ASSERT_EQ(text.triangles.size(), 4u);
  EXPECT_EQ(text.triangles, binary.triangles);
  EXPECT_EQ(text.vertices, binary.vertices);
  EXPECT_EQ(text.vertices[3], Vector3d(0, -1, 0)) << "y up becomes z up";
  EXPECT_EQ(color(text), red);
}

TEST_F(Gltf, QuantizedNumbersAreNumbers) {
  document_["extensionsRequired"] = document_["extensionsUsed"] = {"KHR_mesh_quantization"};
  const TriangleMesh plain = read();
  const auto expect_same = [&](std::size_t accessor, double tolerance) {
    primitive()["attributes"]["POSITION"] = accessor;
    const TriangleMesh mesh = read();
    ASSERT_EQ(mesh.vertices.size(), 4u);
    for (std::size_t i = 0; i < 4; ++i) EXPECT_LT((mesh.vertices[i] - plain.vertices[i]).norm(), tolerance);
  };
  expect_same(add<std::int16_t>("VEC3", 5122, {0, 0, 0, 32767, 0, 0, 0, 32767, 0, 0, 0, 32767}, true), 1e-6);
  expect_same(add<std::uint16_t>("VEC3", 5123, {0, 0, 0, 65535, 0, 0, 0, 65535, 0, 0, 0, 65535}, true), 1e-6);
  expect_same(add<std::int8_t>("VEC3", 5120, {0, 0, 0, 127, 0, 0, 0, 127, 0, 0, 0, 127}, true), 1e-6);
  expect_same(add<std::uint8_t>("VEC3", 5121, {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}), 1e-6);
  primitive()["attributes"]["TEXCOORD_0"] =
      add<std::uint16_t>("VEC2", 5123, {50000, 0, 60000, 0, 50000, 100, 50000, 100}, true);
  EXPECT_EQ(color(read()), blue);
  EXPECT_EQ(left_out_, "");
}

TEST_F(Gltf, SparseValuesReplaceOthers) {
  const std::size_t places = add<std::uint16_t>("SCALAR", 5123, {1});
  const std::size_t values = add<float>("VEC3", 5126, {2, 0, 0});
  document_["accessors"][0]["sparse"] = {{"count", 1},
                                         {"indices", {{"bufferView", places}, {"componentType", 5123}}},
                                         {"values", {{"bufferView", values}}}};
  EXPECT_EQ(read().vertices[1], Vector3d(2, 0, 0));
}

TEST_F(Gltf, TexturesLieAsTheirTransformSays) {
  const auto with = [&](const json& transform) {
    texture_info()["extensions"]["KHR_texture_transform"] = transform;
    return color(read());
  };
  EXPECT_EQ(with({{"offset", {0.5, 0}}}), blue);
  EXPECT_EQ(with({{"scale", {5, 1}}}), blue);
  EXPECT_EQ(with({{"rotation", 3.14159265}}), blue) << "turned about the corner, and repeated";
  EXPECT_EQ(with({{"offset", {0, 0.5}}}), red);
  primitive()["attributes"]["TEXCOORD_1"] =
      add<float>("VEC2", 5126, {0.6f, 0, 0.7f, 0, 0.6f, 0.1f, 0.6f, 0.1f});
  EXPECT_EQ(with({{"texCoord", 1}}), blue);
  EXPECT_EQ(left_out_, "");
}

TEST_F(Gltf, WrapsAreAppliedOrTold) {
  texture_info()["extensions"]["KHR_texture_transform"] = {{"offset", {1.0, 0}}};
  EXPECT_EQ(color(read()), red);
  document_["samplers"] = {{{"wrapS", 33648}}};
  document_["textures"][0]["sampler"] = 0;
  EXPECT_EQ(color(read()), blue) << "the mirror image follows";
  EXPECT_EQ(left_out_, "");
  document_["samplers"][0]["wrapS"] = 33071;
  read();
  expect_told("CLAMP_TO_EDGE");
}

TEST_F(Gltf, PicturesOfOtherKindsAreAppliedOrTold) {
  // A WebP of one pixel, yellowish or not: it is read.
  const std::string webp = "data:image/webp;base64,UklGRhYAAABXRUJQVlA4TAkAAAAvAAAAAIiI/gcA";
  document_["images"].push_back({{"uri", webp}});
  document_["textures"] = {{{"extensions", {{"EXT_texture_webp", {{"source", 1}}}}}}};
  document_["extensionsRequired"] = document_["extensionsUsed"] = {"EXT_texture_webp"};
  EXPECT_EQ(read().textures.at(0).width, 1);
  EXPECT_EQ(left_out_, "");
  std::ofstream(folder_.path() / "skin.ktx2", std::ios::binary) << "\xABKTX 20\xBB\r\n\x1A\n"
                                                                << std::string(80, 'x');
  document_["images"][1] = {{"uri", "skin.ktx2"}};
  document_["textures"] = {{{"extensions", {{"KHR_texture_basisu", {{"source", 1}}}}}}};
  document_["extensionsRequired"] = document_["extensionsUsed"] = {"KHR_texture_basisu"};
  EXPECT_TRUE(read().textures.empty());
  expect_told("'skin.ktx2' is a KTX2 picture");
  expect_told("KHR_texture_basisu");
  document_["images"][1] = {{"uri", "not%20there.png"}};
  read();
  expect_told("'not%20there.png' is not there");
  // With a picture for those who lack the extension, that one is taken.
  document_["textures"][0]["source"] = 0;
  EXPECT_EQ(color(read()), red);
}

TEST_F(Gltf, SpecularGlossinessGivesItsDiffuseColour) {
  document_["materials"] = {
      {{"extensions", {{"KHR_materials_pbrSpecularGlossiness", {{"diffuseFactor", {0, 1, 0, 1}}}}}}}};
  const TriangleMesh mesh = read();
  EXPECT_EQ(mesh.colors.at(0), (std::array<std::uint8_t, 3>{0, 255, 0}));
  expect_told("KHR_materials_pbrSpecularGlossiness");
}

TEST_F(Gltf, WhatIsRequiredAndUnknownIsRefusedByName) {
  for (const char* name : {"EXT_meshopt_compression", "VENDOR_folded_space", "KHR_implicit_shapes"}) {
    document_["extensionsRequired"] = {name};
    EXPECT_NE(complaint().find(std::string("thing.gltf: needs the extension ") + name), std::string::npos)
        << complaint();
  }
}

TEST_F(Gltf, EveryLossIsTold) {
  document_["extensionsUsed"] = {"VENDOR_sparkle", "KHR_materials_clearcoat"};
  document_["materials"][0]["extensions"]["KHR_materials_ior"] = {{"ior", 1.3}};  // undeclared
  document_["materials"][0]["normalTexture"] = {{"index", 0}};
  document_["materials"][0]["alphaMode"] = "BLEND";
  document_["animations"] = {{{"channels", json::array()}}};
  primitive()["targets"] = {{{"POSITION", 0}}};
  document_["meshes"][0]["primitives"].push_back({{"attributes", {{"POSITION", 0}}}, {"mode", 1}});
  EXPECT_EQ(read().triangles.size(), 4u);
  for (const char* words : {"VENDOR_sparkle", "KHR_materials_clearcoat", "KHR_materials_ior", "normalTexture",
                            "alphaMode", "animations", "morph targets", "points and lines"})
    expect_told(words);
}

TEST_F(Gltf, InstancesStripsAndMirrors) {
  const std::size_t places = add<float>("VEC3", 5126, {0, 0, 0, 5, 0, 0});
  document_["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["TRANSLATION"] = places;
  document_["nodes"][0]["scale"] = {-1, 1, 1};
  TriangleMesh mesh = read();
  ASSERT_EQ(mesh.triangles.size(), 8u);
  EXPECT_NEAR(extent_of(mesh.vertices).low.x(), -6, 1e-6);
  tidy(mesh);
  EXPECT_NEAR(mass_properties(mesh).volume, 2.0 / 6, 1e-6);
  document_["nodes"][0] = {{"mesh", 0}};
  primitive()["mode"] = 5;
  primitive()["indices"] = add<std::uint16_t>("SCALAR", 5123, {0, 2, 1, 3, 0, 2});
  mesh = read();
  tidy(mesh);
  EXPECT_TRUE(is_closed(mesh));
}

TEST_F(Gltf, BrokenReferencesAreComplaints) {
  const json sound = document_;
  const auto broken = [&](const char* place, const json& value) {
    document_ = sound;
    document_[json::json_pointer(place)] = value;
    return complaint();
  };
  EXPECT_NE(broken("/nodes/0/mesh", 7).find("thing.gltf: "), std::string::npos);
  EXPECT_NE(broken("/nodes/0/children", {0}).find("nested too deeply"), std::string::npos);
  EXPECT_NE(broken("/accessors/0/count", 4000).find("beyond its view"), std::string::npos);
  EXPECT_NE(broken("/accessors/0/count", -1).find("thing.gltf: "), std::string::npos);
  EXPECT_NE(broken("/bufferViews/0/byteLength", 1 << 20).find("beyond its buffer"), std::string::npos);
  EXPECT_NE(broken("/accessors/2/componentType", 5126).find("thing.gltf: "), std::string::npos);
  EXPECT_NE(broken("/meshes/0/primitives", "none").find("thing.gltf: "), std::string::npos);
}

}  // namespace
}  // namespace flowscope
