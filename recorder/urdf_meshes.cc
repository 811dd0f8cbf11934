#include "recorder/urdf_meshes.h"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "recorder/mesh/mesh_import.h"
#include "recorder/mesh/mesh_picture.h"
#include "render/encode.h"

namespace flowscope {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMost_triangles = 200'000;  ///< MuJoCo's own limit
constexpr std::size_t kStl_head = 84, kStl_triangle = 50;

std::string lower(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}
std::string ending_of(const fs::path& file) { return lower(file.extension().string()); }

/// %20 and the like, which a URI may have.
std::string without_percent(const std::string& text) {
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool is_code = text[i] == '%' && i + 2 < text.size() &&
                         std::isxdigit(static_cast<unsigned char>(text[i + 1])) &&
                         std::isxdigit(static_cast<unsigned char>(text[i + 2]));
    if (is_code) result += static_cast<char>(std::strtol(text.substr(i + 1, 2).c_str(), nullptr, 16));
    if (is_code) i += 2;
    if (!is_code) result += text[i];
  }
  return result;
}

bool is_file(const fs::path& path) {
  std::error_code none;
  return fs::is_regular_file(path, none);
}

/// In any folder above, with the package's name or without: `folder` is inside the package, or beside it.
fs::path find_in_package(const fs::path& whole, const fs::path& folder) {
  const fs::path inside = whole.lexically_relative(*whole.begin());
  fs::path above = fs::absolute(folder).lexically_normal();
  for (;; above = above.parent_path()) {
    for (const auto& rest : {inside, whole}) {
      if (is_file(above / rest)) return above / rest;
    }
    if (above == above.parent_path()) return {};
  }
}

/// Absolute; empty when there is no such file.
fs::path find_mesh(const std::string& name, const fs::path& folder) {
  if (name.empty()) return {};
  fs::path found;
  const auto scheme = name.find("://");
  if (scheme == std::string::npos) {
    found = folder / name;
  } else if (name.starts_with("file://")) {
    found = folder / name.substr(scheme + 3);
  } else if (name.size() > scheme + 3) {
    found = find_in_package(name.substr(scheme + 3), folder);
  }
  if (!is_file(found)) found = folder / fs::path(name).filename();
  return is_file(found) ? fs::absolute(found).lexically_normal() : fs::path();
}

/// MuJoCo reads binary files alone, and those only to the byte.
bool is_plain_stl(const std::string& bytes) {
  if (bytes.size() < kStl_head) return false;
  std::uint32_t triangles = 0;
  std::memcpy(&triangles, bytes.data() + kStl_head - sizeof triangles, sizeof triangles);
  return bytes.size() == kStl_head + kStl_triangle * std::size_t{triangles};
}

/// Whether the file itself says what colours it has; else those of the URDF hold.
bool has_own_colors(const std::string& ending, const std::string& bytes) {
  const auto has = [&](const char* word) { return bytes.find(word) != std::string::npos; };
  if (ending == ".dae") return has("<effect");
  if (ending == ".gltf" || ending == ".glb") return has("\"materials\"");
  if (ending == ".obj") return has("mtllib");
  if (ending == ".ply") return bytes.substr(0, bytes.find("end_header")).find("red") != std::string::npos;
  return false;
}

/// Of a URDF's meshes the plain coordinates count, whatever axis a COLLADA file calls up: so do RViz and
/// Gazebo. The reader has turned those that say Z_UP.
std::optional<char> up_axis(const std::string& ending, const std::string& bytes) {
  if (ending != ".dae" || bytes.find("Z_UP</up_axis>") != std::string::npos) return std::nullopt;
  return 'z';
}

std::string rgba_of(const std::array<std::uint8_t, 3>& color) {
  char text[64];
  std::snprintf(text, sizeof text, "%.4f %.4f %.4f 1", color[0] / 255.0, color[1] / 255.0, color[2] / 255.0);
  return text;
}

void paint(XmlElement& shape, const std::string& name, const std::string& rgba) {
  std::erase_if(shape.children, [](const XmlElement& child) { return child.tag == "material"; });
  shape.add({"material",
             {{"name", to_xml_value("flowscope_" + name)}},
             {{"color", {{"rgba", rgba}}, {}, shape.place}},
             shape.place});
}

}  // namespace

void UrdfMeshes::open(XmlElement& robot, const XmlElement* own) {
  is_own_ = own != nullptr;
  strips_ = is_own_;  // MuJoCo's default in a URDF
  for (const auto& child : own ? own->children : std::vector<XmlElement>{}) {
    if (child.tag != "compiler") continue;
    if (const auto value = child.get("meshdir"); !value.empty()) own_folder_ = from_xml_value(value);
    if (const auto value = child.get("strippath"); !value.empty()) strips_ = value == "true";
  }
  find_uses(robot, nullptr);
  check_all_there();
  for (Use& use : uses_) place(use);
}

OpenedUrdf UrdfMeshes::take() { return std::move(opened_); }

void UrdfMeshes::find_uses(XmlElement& element, XmlElement* shape) {
  if (element.tag == "visual" || element.tag == "collision") shape = &element;
  if (element.tag == "mesh" && shape) {
    const std::string name = from_xml_value(element.get("filename"));
    fs::path file = own_path(element);
    if (file.empty()) file = find_mesh(name, urdf_.folder());
    if (file.empty()) file = find_mesh(without_percent(name), urdf_.folder());
    uses_.push_back({&element, shape, std::move(file)});
  }
  for (auto& child : element.children) find_uses(child, shape);
}

/// Where MuJoCo finds it as the URDF's own <mujoco> tells it to; empty when it does not.
fs::path UrdfMeshes::own_path(const XmlElement& mesh) const {
  const fs::path name = from_xml_value(mesh.get("filename"));
  const fs::path path = urdf_.folder() / own_folder_ / (strips_ ? name.filename() : name);
  return is_own_ && is_file(path) ? fs::absolute(path).lexically_normal() : fs::path();
}

void UrdfMeshes::check_all_there() const {
  std::vector<std::string> missing;
  for (const Use& use : uses_) {
    if (!use.file.empty()) continue;
    const std::string name = from_xml_value(use.mesh->get("filename"));
    std::string text = urdf_.place(use.mesh->place) +
                       (name.empty() ? ": <mesh> names no file" : ": the mesh " + name + " is not there");
    if (name.find("://") != std::string::npos && !name.starts_with("file://"))
      text += " (looked for in " + fs::absolute(urdf_.folder()).lexically_normal().string() +
              " and every folder above)";
    if (std::ranges::find(missing, text) == missing.end()) missing.push_back(std::move(text));
  }
  std::string all;
  for (const auto& text : missing) all += (all.empty() ? "" : "\n") + text;
  if (!all.empty()) throw SceneError(all);
}

void UrdfMeshes::place(Use& use) {
  if (is_converted(use)) return;
  // MuJoCo calls a mesh after its file, takes meshes of one name for one, and stumbles over further scales.
  const auto [known, is_new] = names_.emplace(use.file.stem().string(), use.version());
  const bool is_taken = !is_new && known->second != use.version();
  if (!is_taken && !own_path(*use.mesh).empty()) return;
  if (!is_taken && !is_own_) {
    use.mesh->set("filename", to_xml_value(use.file.string()));
    return;
  }
  std::string& copy = copies_[use.version()];
  if (copy.empty()) {
    copy = is_taken ? free_name(use.version(), ending_of(use.file)) : use.file.filename().string();
    opened_.files.emplace_back(copy, read_text(use.file));
  }
  use.mesh->set("filename", to_xml_value(copy));
}

/// False for what the simulator reads as it is.
bool UrdfMeshes::is_converted(const Use& use) {
  const std::string ending = ending_of(use.file);
  const bool is_visual = use.shape->tag == "visual";
  if (ending == ".msh") return false;
  if (ending == ".stl" && is_plain_stl(read_text(use.file))) return false;
  if (ending == ".obj" && !(is_visual && has_own_colors(ending, read_text(use.file)))) return false;
  try {
    const Converted& mesh = converted(use);
    use.mesh->set("filename", to_xml_value(mesh.file));
    if (is_visual && mesh.rgba) paint(*use.shape, mesh.file, *mesh.rgba);
  } catch (const SceneError& error) {
    if (ending != ".obj") throw;
    if (note_) note_(std::string(error.what()) + "; it is shown without its colours");
    return false;
  }
  return true;
}

const UrdfMeshes::Converted& UrdfMeshes::converted(const Use& use) {
  if (const auto known = converted_.find(use.version()); known != converted_.end()) return known->second;
  const std::string ending = ending_of(use.file), bytes = read_text(use.file);
  MeshImportOptions options;
  options.up = up_axis(ending, bytes);
  options.leave_out = note_;
  TriangleMesh mesh;
  try {
    mesh = read_mesh(use.file, options);
  } catch (const BadMesh& error) {
    throw SceneError(urdf_.place(use.mesh->place) + ": " + error.what());
  }
  if (mesh.triangles.size() > kMost_triangles) {
    throw SceneError(urdf_.place(use.mesh->place) + ": " + use.file.string() + " has " +
                     std::to_string(mesh.triangles.size()) + " triangles, more than the simulator draws (" +
                     std::to_string(kMost_triangles) + "); make it simpler first");
  }
  tidy(mesh);
  const bool is_colored = has_own_colors(ending, bytes);
  if (!is_colored) {
    mesh.colors.clear();
    mesh.textures.clear();
    mesh.texture_of.clear();
    mesh.texture_corners.clear();
  }
  const MeshPicture picture = picture_of(mesh);
  Converted& result = converted_[use.version()];
  result.file = free_name(use.version(), ".obj");
  opened_.files.emplace_back(result.file, picture.obj);
  const std::string name = fs::path(result.file).stem().string();
  if (picture.skin.width > 0) {
    const auto png = encode_png(picture.skin);
    opened_.files.emplace_back(name + ".png", std::string(png.begin(), png.end()));
    opened_.skins[name] = name + ".png";
  } else if (is_colored && !mesh.colors.empty()) {
    result.rgba = rgba_of(mesh.colors[0]);
  }
  return result;
}

/// One that no other mesh has; a file that has its own name in another scale gets a number.
std::string UrdfMeshes::free_name(const Version& version, const std::string& ending) {
  const std::filesystem::path& file = version.first;
  const auto own = names_.find(file.stem().string());
  const bool is_scaled = own != names_.end() && own->second.first == file;
  const std::string stem =
      file.stem().string() + (is_scaled ? "" : "_" + file.extension().string().substr(1));
  for (int i = is_scaled ? 1 : 0;; ++i) {
    const std::string name = stem + (i == 0 ? "" : std::to_string(i));
    if (names_.emplace(name, version).second) return name + ending;
  }
}

}  // namespace flowscope
