#include "recorder/mesh/gltf_mesh.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "recorder/mesh/gltf_draco.h"
#include "recorder/mesh/gltf_file.h"
#include "recorder/mesh/gltf_material.h"

namespace flowscope {
namespace {

using nlohmann::json;
using Vectors = std::vector<std::array<float, 4>>;

constexpr std::size_t kMost_triangles = 1'000'000, kMost_nodes = 100'000;
constexpr int kMost_levels = 64;

Eigen::Affine3d placed(const Eigen::Vector3d& at, const Eigen::Vector4d& xyzw, const Eigen::Vector3d& scale) {
  const Eigen::Quaterniond turn(xyzw[3], xyzw[0], xyzw[1], xyzw[2]);
  Eigen::Affine3d place = Eigen::Affine3d::Identity();
  place.linear() = (turn.norm() > 0 ? turn.normalized() : Eigen::Quaterniond::Identity()).toRotationMatrix() *
                   scale.asDiagonal();
  place.translation() = at;
  return place;
}

Eigen::Affine3d placement(const json& node) {
  Eigen::Affine3d place = Eigen::Affine3d::Identity();
  if (node.contains("matrix")) {
    const auto values = node["matrix"].get<std::array<double, 16>>();
    place.matrix() = Eigen::Map<const Eigen::Matrix4d>(values.data());
    return place;
  }
  const auto at = node.value("translation", std::array<double, 3>{0, 0, 0});
  const auto turn = node.value("rotation", std::array<double, 4>{0, 0, 0, 1});
  const auto scale = node.value("scale", std::array<double, 3>{1, 1, 1});
  return placed({at[0], at[1], at[2]}, {turn[0], turn[1], turn[2], turn[3]}, {scale[0], scale[1], scale[2]});
}

/// A primitive's data, compressed or not.
struct Primitive {
  std::vector<std::uint32_t> corners;  ///< three for each triangle
  Vectors positions, colors, places;   ///< colours and places: one per position, or none
};

class GltfMesh {
 public:
  GltfMesh(const GltfFile& file, const TellLoss& tell, const std::function<void()>& now_pictures)
      : file_(file),
        tell_([this, tell](const std::string& what) {
          if (told_.insert(what).second && tell) tell(what);
        }),
        store_(file.folder()),
        materials_(file, store_, tell_, now_pictures) {}

  TriangleMesh read() {
    check_extensions(file_.root(), tell_);
    tell_losses(file_.root(), tell_);
    for (const std::size_t node : roots()) add(node, Eigen::Affine3d::Identity(), 0);
    for (const auto& [name, why] : store_.left_out())
      tell_("its texture '" + name + "' " + why + "; the material's plain colour is used");
    mesh_.textures = store_.take();
    return std::move(mesh_);
  }

 private:
  std::vector<std::size_t> roots() const {
    const json& root = file_.root();
    if (root.contains("scenes") && !root["scenes"].empty())
      return file_.entry("scenes", root.value("scene", std::size_t{0}))
          .value("nodes", std::vector<std::size_t>{});
    std::set<std::size_t> children;
    const json nodes = root.value("nodes", json::array());
    for (const json& node : nodes)
      for (const json& child : node.value("children", json::array()))
        children.insert(child.get<std::size_t>());
    std::vector<std::size_t> found;
    for (std::size_t i = 0; i < nodes.size(); ++i)
      if (!children.contains(i)) found.push_back(i);
    return found;
  }

  void add(std::size_t index, const Eigen::Affine3d& parent, int level) {
    if (level > kMost_levels || ++nodes_ > kMost_nodes) throw BadGltf("its nodes are nested too deeply");
    const json& node = file_.entry("nodes", index);
    const Eigen::Affine3d place = parent * placement(node);
    if (node.contains("mesh")) {
      const json& mesh = file_.entry("meshes", node["mesh"].get<std::size_t>());
      for (const Eigen::Affine3d& instance : instances(node, place))
        for (const json& primitive : mesh.at("primitives")) add(primitive, instance);
    }
    for (const json& child : node.value("children", json::array()))
      add(child.get<std::size_t>(), place, level + 1);
  }

  std::vector<Eigen::Affine3d> instances(const json& node, const Eigen::Affine3d& place) const {
    const json about =
        node.value("extensions", json::object()).value("EXT_mesh_gpu_instancing", json::object());
    if (!about.contains("attributes")) return {place};
    std::size_t width = 0, count = 0;
    std::map<std::string, Vectors> values;
    for (const auto& [name, accessor] : about["attributes"].items()) {
      if (name != "TRANSLATION" && name != "ROTATION" && name != "SCALE") continue;
      values[name] = file_.vectors(accessor.get<std::size_t>(), width);
      count = std::max(count, values[name].size());
    }
    if (count > kMost_nodes) throw BadGltf("has more than 100000 instances of a mesh");
    std::vector<Eigen::Affine3d> places;
    const auto value = [&](const char* name, std::size_t i,
                           const Eigen::Vector4d& otherwise) -> Eigen::Vector4d {
      const Vectors& of = values[name];
      return i < of.size() ? Eigen::Map<const Eigen::Vector4f>(of[i].data()).cast<double>() : otherwise;
    };
    for (std::size_t i = 0; i < count; ++i)
      places.push_back(place * placed(value("TRANSLATION", i, {0, 0, 0, 0}).head<3>(),
                                      value("ROTATION", i, {0, 0, 0, 1}),
                                      value("SCALE", i, {1, 1, 1, 1}).head<3>()));
    return places;
  }

  /// Triangles as they are listed, or of a strip or a fan.
  std::vector<std::uint32_t> triangles(const std::vector<std::uint32_t>& listed, int mode) const {
    if (mode == 4) return {listed.begin(), listed.end() - static_cast<std::ptrdiff_t>(listed.size() % 3)};
    std::vector<std::uint32_t> corners;
    for (std::size_t i = 2; i < listed.size(); ++i) {
      const std::uint32_t a = mode == 6 ? listed[0] : listed[i - 2], b = listed[i - 1], c = listed[i];
      const bool turned = mode == 5 && i % 2 == 1;
      corners.insert(corners.end(), {turned ? b : a, turned ? a : b, c});
    }
    return corners;
  }

  Primitive data_of(const json& primitive, const GltfLook& look, int mode) const {
    const json& attributes = primitive.at("attributes");
    const std::string place = "TEXCOORD_" + std::to_string(look.channel);
    const json draco =
        primitive.value("extensions", json::object()).value("KHR_draco_mesh_compression", json::object());
    DracoPrimitive unpacked;
    if (!draco.empty()) {
      std::map<std::string, std::uint32_t> ids;
      for (const auto& [name, id] : draco.at("attributes").items())
        if (name == "POSITION" || name == "COLOR_0" || name == place) ids[name] = id.get<std::uint32_t>();
      unpacked = decode_draco(file_.view(draco.at("bufferView").get<std::size_t>()), ids);
    }
    const auto read = [&](const std::string& name, std::size_t least, std::size_t most) -> Vectors {
      std::size_t width = 0;
      Vectors values;
      if (const auto it = unpacked.attributes.find(name); it != unpacked.attributes.end()) {
        values = it->second, width = unpacked.widths.at(name);
      } else if (attributes.contains(name)) {
        values = file_.vectors(attributes[name].get<std::size_t>(), width);
      } else {
        return {};
      }
      if (width < least || width > most)
        throw BadGltf("has a " + name + " of " + std::to_string(width) + " numbers");
      return values;
    };
    Primitive data;
    data.positions = read("POSITION", 3, 3);
    data.colors = read("COLOR_0", 3, 4);
    data.places = read(place, 2, 2);
    std::vector<std::uint32_t> listed = std::move(unpacked.indices);
    if (draco.empty() && primitive.contains("indices")) {
      listed = file_.indices(primitive["indices"].get<std::size_t>());
    } else if (draco.empty()) {
      for (std::size_t i = 0; i < data.positions.size(); ++i) listed.push_back(static_cast<std::uint32_t>(i));
    }
    data.corners = triangles(listed, draco.empty() ? mode : 4);
    for (const std::uint32_t corner : data.corners)
      if (corner >= data.positions.size()) throw BadGltf("a triangle names a corner that does not exist");
    if (!data.colors.empty() && data.colors.size() < data.positions.size())
      throw BadGltf("has fewer colours than corners");
    if (!data.places.empty() && data.places.size() < data.positions.size())
      throw BadGltf("has fewer texture coordinates than corners");
    return data;
  }

  void add(const json& primitive, const Eigen::Affine3d& place) {
    const int mode = primitive.value("mode", 4);
    if (mode < 4 || mode > 6) return tell_("its points and lines are not taken over");
    const bool dressed = primitive.contains("material");
    const GltfLook look = dressed ? materials_.of(primitive["material"].get<std::size_t>()) : GltfLook{};
    const Primitive data = data_of(primitive, look, mode);
    if (mesh_.triangles.size() + data.corners.size() / 3 > kMost_triangles)
      throw BadGltf("has more than 1000000 triangles; make it simpler first");
    const int first = static_cast<int>(mesh_.vertices.size());
    for (const auto& p : data.positions) mesh_.vertices.push_back(place * Eigen::Vector3d(p[0], p[1], p[2]));
    const bool textured = look.texture >= 0 && !data.places.empty();
    if (look.texture >= 0 && data.places.empty())
      tell_("its texture '" + look.name + "' has no place on a part of the mesh that lacks TEXCOORD_" +
            std::to_string(look.channel));
    const auto is_white = [](const auto& c) { return std::min({c[0], c[1], c[2]}) > 0.999f; };
    if (textured && !std::ranges::all_of(data.colors, is_white))
      tell_("its vertex colours are not taken over where texture '" + look.name + "' lies");
    const bool mirrored = place.linear().determinant() < 0;
    for (std::size_t i = 0; i + 2 < data.corners.size(); i += 3) {
      std::array<std::uint32_t, 3> corners{data.corners[i], data.corners[i + 1], data.corners[i + 2]};
      if (mirrored) std::swap(corners[1], corners[2]);
      add_triangle(data, look, corners, first, textured, dressed);
    }
  }

  void add_triangle(const Primitive& data, const GltfLook& look, const std::array<std::uint32_t, 3>& corners,
                    int first, bool textured, bool dressed) {
    TextureCorners places{Eigen::Vector2f::Zero(), Eigen::Vector2f::Zero(), Eigen::Vector2f::Zero()};
    std::array<double, 3> color{0, 0, 0};
    std::array<int, 3> triangle{};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t corner = corners[k];
      triangle[k] = first + static_cast<int>(corner);
      for (std::size_t c = 0; c < 3; ++c) color[c] += (data.colors.empty() ? 1 : data.colors[corner][c]) / 3;
      if (!textured) continue;
      places[k] = look.place(data.places[corner]);
      if (!(places[k].cwiseAbs().maxCoeff() < 1e4f)) throw BadGltf("has a corner far outside its texture");
      const Eigen::Vector2f beyond = (places[k].array() - 0.5f).abs() - 0.501f;
      if ((look.held_u && beyond.x() > 0) || (look.held_v && beyond.y() > 0))
        tell_("its texture '" + look.name +
              "' is repeated where it should be held at its edges (CLAMP_TO_EDGE)");
    }
    mesh_.triangles.push_back(triangle);
    mesh_.texture_of.push_back(textured ? look.texture : -1);
    mesh_.texture_corners.push_back(places);
    std::array<std::uint8_t, 3> shown{};
    for (std::size_t c = 0; c < 3; ++c) {
      const double light = dressed || !data.colors.empty() ? look.factor[c] * color[c] : 0.448;  // grey 0.7
      shown[c] =
          static_cast<std::uint8_t>(std::lround(255 * std::clamp(to_srgb(std::max(0.0, light)), 0.0, 1.0)));
    }
    mesh_.colors.push_back(shown);
  }

  const GltfFile& file_;
  std::set<std::string> told_;
  TellLoss tell_;
  TextureStore store_;
  GltfMaterials materials_;
  std::size_t nodes_ = 0;
  TriangleMesh mesh_;
};

}  // namespace

std::optional<TriangleMesh> read_gltf(const std::filesystem::path& file, const TellLoss& tell,
                                      const std::function<void()>& now_pictures) {
  try {
    const GltfFile opened(file);
    if (!opened.is_version_2()) return std::nullopt;
    return GltfMesh(opened, tell, now_pictures).read();
  } catch (const json::exception& error) {
    throw BadGltf(std::string("is no sound glTF: ") + error.what());
  }
}

}  // namespace flowscope
