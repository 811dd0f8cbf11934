#include "recorder/mesh/mesh_object.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <cstdio>
#include <limits>
#include <span>
#include <stdexcept>

#include "recorder/mesh/box_fit.h"
#include "recorder/mesh/convex_hull.h"
#include "recorder/mesh/mesh_picture.h"
#include "recorder/new_folder.h"
#include "render/encode.h"
#include "render/mujoco_guard.h"
#include "render/mujoco_owners.h"

namespace flowscope {
namespace {

using Eigen::Vector3d;

constexpr double kLeast_size_m = 0.001, kMost_size_m = 10;
constexpr std::size_t kMost_drawn = 200'000;  ///< triangles; the simulator's own limit for such files

/// Without this a mesh touches anything in one point, and whatever stands on one point rocks.
const char* const several_contacts = "  <option>\n    <flag multiccd=\"enable\"/>\n  </option>\n";

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", value);
  return text;
}

std::string numbers(const std::vector<double>& values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : " ") + number(value);
  return text;
}

void check_name(const std::string& name) {
  const bool plain = !name.empty() && name.size() <= 60 &&
                     !std::isdigit(static_cast<unsigned char>(name[0])) &&
                     std::ranges::all_of(name, [](unsigned char c) { return std::isalnum(c) || c == '_'; });
  if (!plain)
    throw std::invalid_argument("'" + name +
                                "' is no name for an object (letters, digits and _, no digit first)");
}

/// Stands it on z = 0, its bounding box around the z axis.
void put_upright(TriangleMesh& mesh, const std::string& name) {
  const Extent extent = extent_of(mesh.vertices);
  const double largest = extent.size().maxCoeff();
  char size[96];
  std::snprintf(size, sizeof size, "%.4g x %.4g x %.4g m", extent.size().x(), extent.size().y(),
                extent.size().z());
  if (largest < kLeast_size_m)
    throw BadMesh(name + ": is only " + size + " large; are its units metres? (--units, --scale)");
  if (largest > kMost_size_m)
    throw BadMesh(name + ": is " + size + " large; are its units metres? (--units, --scale)");
  Vector3d origin = 0.5 * (extent.low + extent.high);
  origin.z() = extent.low.z();
  for (Vector3d& v : mesh.vertices) v -= origin;
}

std::string material_xml(const std::string& name, const MeshPicture& picture, const TriangleMesh& mesh) {
  const std::string shine = "specular=\"0.2\" shininess=\"0.3\"/>\n";
  if (picture.skin.width > 0) {
    return "    <texture name=\"" + name + "_colors\" type=\"2d\" file=\"" + name + "_colors.png\"/>\n" +
           "    <material name=\"" + name + "\" texture=\"" + name + "_colors\" " + shine;
  }
  std::vector<double> rgba{0.7, 0.7, 0.7, 1};
  if (!mesh.colors.empty())
    for (std::size_t i = 0; i < 3; ++i) rgba[i] = mesh.colors[0][i] / 255.0;
  return "    <material name=\"" + name + "\" rgba=\"" + numbers(rgba) + "\" " + shine;
}

/// The files of one object: they appear together with keep(), or not at all.
class Files {
 public:
  Files(const std::filesystem::path& folder, const std::string& name)
      : folder_(folder), staged_(checked(folder, name), folder) {}

  void write(const std::string& file, std::span<const std::uint8_t> bytes) {
    names_.push_back(file);
    staged_.write(file, bytes);
  }
  void write(const std::string& file, const std::string& text) {
    write(file, std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
  }
  /// Where a file lies until keep().
  std::filesystem::path staged(const std::string& file) const { return staged_.path() / file; }
  /// The last one that was written comes last: whoever sees it sees what it names.
  std::vector<std::filesystem::path> keep() {
    staged_.sync();
    staged_.move_into_parent(names_);
    std::vector<std::filesystem::path> all;
    for (const auto& name : names_) all.push_back(folder_ / name);
    return all;
  }

 private:
  static const std::filesystem::path& checked(const std::filesystem::path& folder, const std::string& name) {
    if (std::filesystem::exists(folder / (name + ".xml")))
      throw std::invalid_argument((folder / (name + ".xml")).string() + " is already there");
    return folder;
  }

  std::filesystem::path folder_;
  NewFolder staged_;
  std::vector<std::string> names_;
};

void check_compiles(const std::filesystem::path& staged, const std::filesystem::path& file) {
  install_mujoco_guard();
  char error[1000] = "";
  const ModelPtr model(mj_loadXML(staged.c_str(), nullptr, error, sizeof error));
  if (!model) throw BadMesh(file.string() + ": the simulator refuses the object: " + error);
}

struct Body {
  double mass = 0;
  MassProperties shape;
};

std::string body_xml(const std::string& name, const Body& body, const std::string& collision_geoms) {
  const Eigen::Matrix3d inertia = body.mass / body.shape.volume * body.shape.inertia;
  const Vector3d& c = body.shape.center;
  return "  <worldbody>\n    <body name=\"" + name + "\">\n      <freejoint name=\"" + name + "_free\"/>\n" +
         "      <inertial pos=\"" + numbers({c.x(), c.y(), c.z()}) + "\" mass=\"" + number(body.mass) +
         "\" fullinertia=\"" +
         numbers({inertia(0, 0), inertia(1, 1), inertia(2, 2), inertia(0, 1), inertia(0, 2), inertia(1, 2)}) +
         "\"/>\n      <geom name=\"" + name + "_visual\" type=\"mesh\" mesh=\"" + name +
         "_visual\" material=\"" + name + "\" contype=\"0\" conaffinity=\"0\" group=\"2\" mass=\"0\"/>\n" +
         collision_geoms + "    </body>\n  </worldbody>\n";
}

std::string collision_geom(const std::string& part, const std::optional<FittedBox>& box) {
  std::string shape = "type=\"mesh\" mesh=\"" + part + "\"";
  if (box) {
    const Vector3d &at = box->world_from_box.position, &half = box->half_size;
    const Eigen::Vector4d turn = box->world_from_box.wxyz();
    shape = "type=\"box\" size=\"" + numbers({half.x(), half.y(), half.z()}) + "\" pos=\"" +
            numbers({at.x(), at.y(), at.z()}) + "\" quat=\"" + numbers({turn[0], turn[1], turn[2], turn[3]}) +
            "\"";
  }
  return "      <geom name=\"" + part + "\" " + shape +
         " group=\"3\" friction=\"0.8 0.01 0.001\" condim=\"4\"/>\n";
}

}  // namespace

ObjectReport write_object(TriangleMesh mesh, const ObjectOptions& options,
                          const std::filesystem::path& folder) {
  const std::string& name = options.name;
  check_name(name);
  tidy(mesh);
  if (mesh.triangles.empty()) throw BadMesh(name + ": all its triangles are without area");
  if (mesh.triangles.size() > kMost_drawn) {
    throw BadMesh(name + ": has " + std::to_string(mesh.triangles.size()) +
                  " triangles, more than the simulator draws (" + std::to_string(kMost_drawn) +
                  "); make it simpler first");
  }
  put_upright(mesh, name);
  const TriangleMesh hull = convex_hull(mesh.vertices);
  if (hull.triangles.empty()) throw BadMesh(name + ": is flat; an object needs a volume");

  ObjectReport report;
  report.closed = is_closed(mesh);
  Body body{0, mass_properties(report.closed ? mesh : hull)};
  // A closed mesh that crosses itself may bound next to nothing.
  if (report.closed && body.shape.volume < 1e-4 * mass_properties(hull).volume) {
    report.closed = false;
    body.shape = mass_properties(hull);
  }
  body.mass = options.mass_kg.value_or(options.density * body.shape.volume);
  const std::vector<TriangleMesh> parts = convex_parts(mesh, options.parts);
  if (parts.empty()) throw BadMesh(name + ": no part of it has a volume");
  const MeshPicture picture = picture_of(mesh);

  Files files(folder, name);
  std::string assets = material_xml(name, picture, mesh);
  const auto add_mesh = [&](const std::string& part, const std::string& obj) {
    files.write(part + ".obj", obj);
    assets += "    <mesh name=\"" + part + "\" file=\"" + part + ".obj\"/>\n";
  };
  if (picture.skin.width > 0) files.write(name + "_colors.png", encode_png(picture.skin));
  add_mesh(name + "_visual", picture.obj);
  std::string geoms;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const std::string part = name + "_part_" + std::to_string(i + 1);
    const auto box = fitted_box(parts[i]);
    if (!box) add_mesh(part, plain_obj(parts[i]));
    geoms += collision_geom(part, box);
    report.parts_volume += mass_properties(parts[i]).volume;
  }
  report.size = extent_of(mesh.vertices).size();
  const std::string about = "<!-- " + number(report.size.x()) + " x " + number(report.size.y()) + " x " +
                            number(report.size.z()) +
                            " m, standing on its origin; written by flowscope scene import -->\n";
  files.write(name + ".xml", about + "<mujoco model=\"" + name + "\">\n" + several_contacts + "  <asset>\n" +
                                 assets + "  </asset>\n" + body_xml(name, body, geoms) + "</mujoco>\n");
  report.file = folder / (name + ".xml");
  check_compiles(files.staged(name + ".xml"), report.file);
  report.all_files = files.keep();
  report.triangles = mesh.triangles.size();
  report.parts = parts.size();
  report.colors = picture.colors;
  report.textures = picture.textures;
  report.volume = body.shape.volume;
  report.mass_kg = body.mass;
  report.center_of_mass = body.shape.center;
  return report;
}

}  // namespace flowscope
