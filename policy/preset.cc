#include "policy/preset.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <map>
#include <stdexcept>
#include <vector>

#include "policy/preset_fields.h"

namespace flowscope {
namespace {

std::filesystem::path preset_folder() {
  const char* assets = std::getenv("FLOWSCOPE_ASSETS");
  return std::filesystem::path(assets ? assets : FLOWSCOPE_SOURCE_ASSETS) / "policies";
}

std::string known_presets() {
  std::vector<std::string> names;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(preset_folder(), ignored))
    if (entry.path().extension() == ".yaml") names.push_back(entry.path().stem().string());
  std::sort(names.begin(), names.end());
  std::string list;
  for (const std::string& n : names) list += (list.empty() ? "" : ", ") + n;
  return list;
}

using Setter = std::function<void(const YAML::Node&)>;

template <typename T>
Setter into(T& target) {
  return [&target](const YAML::Node& value) { target = value.as<T>(); };
}

std::map<std::string, Setter> keys_of(Preset& preset) {
  std::map<std::string, Setter> keys;
  const auto field = [&keys](const char* name, auto& target) { keys[name] = into(target); };
  visit_shape(preset.shape, field);
  visit_later_shape(preset.shape, field);
  visit_rates(preset.rates, field);
  visit_later_rates(preset.rates, field);
  visit_radius(preset.radius, field);
  return keys;
}

}  // namespace

Preset load_preset(const std::string& name) {
  const std::filesystem::path file = preset_folder() / (name + ".yaml");
  if (name.find_first_of("/\\.") != std::string::npos || !std::filesystem::exists(file))
    throw std::invalid_argument("no policy preset '" + name + "'; there are: " + known_presets());
  Preset preset;
  const auto setters = keys_of(preset);
  try {
    for (const auto& entry : YAML::LoadFile(file.string())) {
      const auto key = entry.first.as<std::string>();
      const auto setter = setters.find(key);
      if (setter == setters.end())
        throw std::invalid_argument(file.string() + ":" + std::to_string(entry.first.Mark().line + 1) +
                                    ": unknown key '" + key + "'");
      setter->second(entry.second);
    }
  } catch (const YAML::Exception& e) {
    throw std::invalid_argument(file.string() + ": " + e.what());
  }
  return preset;
}

}  // namespace flowscope
