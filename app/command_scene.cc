// flowscope scene: a user's own things as objects of a scene.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <chrono>
#include <cstdio>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "app/cli.h"
#include "app/commands.h"
#include "recorder/mesh/mesh_object.h"

namespace flowscope::app {
namespace {

struct ImportCall {
  std::vector<std::filesystem::path> meshes;
  std::filesystem::path out;
  std::string name, units = "m";
  std::optional<double> scale, mass;
  std::optional<std::string> up;
  double density = 1000;
  PartOptions parts;
};

double metres_per_unit(const ImportCall& call) {
  if (call.scale) return *call.scale;
  static const std::map<std::string, double> known{{"m", 1}, {"cm", 0.01}, {"mm", 0.001}, {"in", 0.0254}};
  return known.at(call.units);
}

/// A file's name as far as it can name an object.
std::string name_from(const std::filesystem::path& file) {
  std::string name = file.stem().string();
  std::ranges::replace_if(
      name, [](unsigned char c) { return !std::isalnum(c); }, '_');
  if (name.empty() || std::isdigit(static_cast<unsigned char>(name[0]))) name.insert(0, "object_");
  return name;
}

TriangleMesh read_all(const ImportCall& call, std::vector<std::string>& left_out) {
  MeshImportOptions options;
  options.metres_per_unit = metres_per_unit(call);
  if (call.up) options.up = call.up->front();
  options.leave_out = [&left_out](const std::string& what) { left_out.push_back(what); };
  TriangleMesh all;
  for (const auto& file : call.meshes) {
    append(all, read_mesh(file, options));
  }
  return all;
}

nlohmann::ordered_json as_json(const ObjectReport& report, const std::string& name) {
  nlohmann::ordered_json files = nlohmann::ordered_json::array();
  for (const auto& file : report.all_files) files.push_back(file.string());
  const auto vector = [](const Eigen::Vector3d& v) { return nlohmann::ordered_json{v.x(), v.y(), v.z()}; };
  return {{"name", name},
          {"file", report.file.string()},
          {"files", files},
          {"size_m", vector(report.size)},
          {"triangles", report.triangles},
          {"colors", report.colors},
          {"textures", report.textures},
          {"closed", report.closed},
          {"parts", report.parts},
          {"volume_m3", report.volume},
          {"parts_volume_m3", report.parts_volume},
          {"excess", report.closed ? nlohmann::ordered_json(report.excess()) : nullptr},
          {"mass_kg", report.mass_kg},
          {"center_of_mass_m", vector(report.center_of_mass)}};
}

constexpr int kMost_parts = 64;
constexpr double kTold_excess = 0.05;

/// What the parts fill in that the mesh leaves open; nothing when that is little.
std::string filled_in(const ObjectReport& report, const ImportCall& call) {
  if (!report.closed || report.excess() <= kTold_excess) return {};
  char text[200];
  std::snprintf(text, sizeof text,
                "holes are filled: its convex parts have %.0f %% more volume than the mesh",
                100 * report.excess());
  const int tried = call.parts.most_parts;
  if (tried >= kMost_parts) return std::string(text) + ", and more parts than --parts 64 there can not be";
  return std::string(text) + "; try --parts " + std::to_string(std::min(kMost_parts, 2 * tried));
}

/// Tells how far the cutting is, every two seconds: a line for people on stderr.
std::function<void(int, int)> told_progress(const std::string& name) {
  using Clock = std::chrono::steady_clock;
  return [name, told = Clock::now()](int done, int of) mutable {
    if (Clock::now() - told < std::chrono::seconds(2)) return;
    told = Clock::now();
    std::fprintf(stderr, "flowscope: cutting %s into convex parts: %d of at most %d cuts\n", name.c_str(),
                 done, of);
  };
}

int import(const ImportCall& call, bool json) {
  ObjectOptions options;
  options.name = call.name.empty() ? name_from(call.meshes.front()) : call.name;
  options.mass_kg = call.mass;
  options.density = call.density;
  options.parts = call.parts;
  options.parts.progress = told_progress(options.name);
  ObjectReport report;
  std::vector<std::string> left_out;
  try {
    report = write_object(read_all(call, left_out), options, call.out);
  } catch (const BadMesh& error) {
    throw UsageError(error.what());
  } catch (const std::invalid_argument& error) {
    throw UsageError(std::string("--name, --out: ") + error.what());
  }
  for (const auto& what : left_out) std::fprintf(stderr, "flowscope: left out: %s\n", what.c_str());
  const std::string filled = filled_in(report, call);
  if (!filled.empty()) std::fprintf(stderr, "flowscope: %s: %s\n", report.file.c_str(), filled.c_str());
  if (json) {
    auto document = as_json(report, options.name);
    document["left_out"] = left_out;
    if (!filled.empty()) document["filled_in"] = filled;
    print_json(document);
    return 0;
  }
  std::printf(
      "%s: %.0f x %.0f x %.0f mm, %.3g kg, %zu triangles, %zu convex part%s with %+.1f %% of its volume\n",
      report.file.c_str(), 1000 * report.size.x(), 1000 * report.size.y(), 1000 * report.size.z(),
      report.mass_kg, report.triangles, report.parts, report.parts == 1 ? "" : "s",
      100 * (report.parts_volume / report.volume - 1));
  if (!report.closed)
    std::printf("the surface is not closed: mass and inertia are those of its convex hull\n");
  const std::string folder = std::filesystem::weakly_canonical(call.out).filename().string();
  if (folder == options.name) {
    std::printf("in a scene.xml beside this folder: <include file=\"%s/%s.xml\"/>\n", folder.c_str(),
                folder.c_str());
  } else {
    std::printf("in a scene.xml in this folder: <include file=\"%s\"/>\n", report.file.filename().c_str());
  }
  return 0;
}

}  // namespace

void add_scene_command(CLI::App& root, Context& context) {
  CLI::App* command = root.add_subcommand("scene", "Bring objects of your own into a scene");
  command->require_subcommand(1);
  CLI::App* add = command->add_subcommand(
      "import",
      "Turn meshes (glTF, COLLADA, OBJ, PLY, STL) into an object with convex collision parts and an inertia");
  auto call = std::make_shared<ImportCall>();
  add->add_option("mesh", call->meshes, "Mesh files; several become one object")
      ->required()
      ->type_name("MESH");
  add->add_option("--out", call->out, "Folder to write into")->required()->type_name("DIR");
  add->add_option("--name", call->name, "Name of the object; by default the first file's");
  auto* units = add->add_option("--units", call->units, "What a length of 1 in the file means")
                    ->check(CLI::IsMember({"m", "cm", "mm", "in"}))
                    ->capture_default_str();
  add->add_option("--scale", call->scale, "Metres in a length of 1, instead of --units")
      ->check(CLI::PositiveNumber)
      ->excludes(units);
  add->add_option("--up", call->up,
                  "Axis of the file that points up; by default y for glTF and COLLADA, else z")
      ->check(CLI::IsMember({"y", "z"}));
  auto* density = add->add_option("--density", call->density, "kg/m^3")
                      ->check(CLI::PositiveNumber)
                      ->capture_default_str();
  add->add_option("--mass", call->mass, "kg, instead of --density")
      ->check(CLI::PositiveNumber)
      ->excludes(density);
  add->add_option("--parts", call->parts.most_parts, "At most so many convex parts")
      ->check(CLI::Range(1, kMost_parts))
      ->capture_default_str();
  add_json_option(*add, context);
  set_body(*add, context, [call, &context] { return import(*call, context.json); });
}

}  // namespace flowscope::app
