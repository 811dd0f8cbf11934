#include "recorder/mesh/obj_materials.h"

#include <cstdlib>
#include <fstream>
#include <set>
#include <sstream>
#include <stdexcept>

#include "recorder/mesh/mesh_neighbour.h"

namespace flowscope {
namespace {

using Materials = std::map<std::string, ObjMaterial>;

std::string trimmed(const std::string& text) {
  const char* const blank = " \t\r\n\"";
  const auto first = text.find_first_not_of(blank);
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(blank) - first + 1);
}

/// The line's first word, and what follows.
std::pair<std::string, std::string> split(const std::string& line) {
  const std::string text = trimmed(line);
  const auto end = text.find_first_of(" \t");
  return {text.substr(0, end), end == std::string::npos ? "" : trimmed(text.substr(end))};
}

std::optional<float> number(const std::string& text) {
  char* end = nullptr;
  const float value = std::strtof(text.c_str(), &end);
  if (text.empty() || *end != '\0') return std::nullopt;
  return value;
}

/// A map's line: options, then a name that may hold blanks.
class MapLine {
 public:
  explicit MapLine(std::string text) : rest_(std::move(text)) {}

  void read_into(ObjMaterial& material, std::set<std::string>& lost) {
    while (rest_.starts_with('-')) {
      const std::string option = word();
      if (option == "-s") {
        numbers(material.scale);
      } else if (option == "-o") {
        numbers(material.offset);
      } else if (option == "-t" || option == "-mm") {
        Eigen::Vector2f ignored;
        numbers(ignored);
        lost.insert("map_Kd " + option);
      } else {  // -clamp on, -blendu off, -texres 512: one word each
        const std::string value = word();
        if (option == "-clamp" && value == "on") lost.insert("map_Kd -clamp");
      }
    }
    material.picture = rest_;
  }

 private:
  std::string word() {
    const auto [first, rest] = split(rest_);
    rest_ = rest;
    return first;
  }
  /// One to three of them; the third is of a depth that pictures lack.
  void numbers(Eigen::Vector2f& to) {
    for (int i = 0; i < 3; ++i) {
      const auto value = number(split(rest_).first);
      if (!value) return;
      if (i < 2) to[i] = *value;
      word();
    }
  }
  std::string rest_;
};

void read_library(const std::filesystem::path& file, Materials& materials, std::set<std::string>& lost) {
  std::ifstream stream(file);
  ObjMaterial* material = nullptr;
  for (std::string line; std::getline(stream, line);) {
    const auto [key, rest] = split(line);
    if (key == "newmtl") material = &materials[rest];
    if (material == nullptr) continue;
    if (key == "Kd") {
      std::istringstream values(rest);
      std::array<float, 3> color{};
      if (values >> color[0] >> color[1] >> color[2]) material->color = color;
    } else if (key == "map_Kd") {
      MapLine(rest).read_into(*material, lost);
    } else if (key.starts_with("map_") || key == "bump" || key == "norm" || key == "disp" || key == "decal") {
      lost.insert(key);
    } else if ((key == "d" && number(rest).value_or(1) < 1) ||
               (key == "Tr" && number(rest).value_or(0) > 0)) {
      lost.insert(key + " (see-through)");
    }
  }
}

/// The libraries of a line: one whose name holds blanks, or several.
std::vector<std::string> names_of(const std::filesystem::path& folder, const std::string& text) {
  std::error_code error;
  if (std::filesystem::exists(folder / text, error)) return {text};
  std::vector<std::string> names;
  std::istringstream words(text);
  bool all_libraries = true;
  for (std::string name; words >> name;) {
    all_libraries = all_libraries && name.ends_with(".mtl");
    names.push_back(name);
  }
  return all_libraries ? names : std::vector<std::string>{text};
}

}  // namespace

Materials obj_materials(const std::filesystem::path& file,
                        const std::function<void(const std::string&)>& tell) {
  const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
  std::set<std::string> libraries, used, lost;
  std::ifstream stream(file);
  for (std::string line; std::getline(stream, line);) {
    const auto first = line.find_first_not_of(" \t");
    if (first == std::string::npos || (line[first] != 'm' && line[first] != 'u')) continue;
    const auto [key, rest] = split(line);
    if (key == "usemtl") used.insert(rest);
    if (key == "mtllib")
      for (const std::string& name : names_of(folder, rest)) libraries.insert(name);
  }
  Materials materials;
  bool all_there = true;
  for (const std::string& name : libraries) {
    try {
      read_library(neighbour(folder, name), materials, lost);
    } catch (const std::runtime_error& error) {
      all_there = false;
      tell("its material file '" + name + "' " + error.what() + "; what it would colour is grey");
    }
  }
  if (all_there)
    for (const std::string& name : used)
      if (!name.empty() && !materials.contains(name))
        tell("its material '" + name + "' is defined in no material file; what it would colour is grey");
  std::string names;
  for (const std::string& name : lost) names += (names.empty() ? "" : ", ") + name;
  if (!names.empty()) tell("of its materials only Kd and map_Kd are taken over, not: " + names);
  return materials;
}

}  // namespace flowscope
