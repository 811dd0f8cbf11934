#include "recorder/mesh/gltf_extensions.h"

#include <map>
#include <set>

#include "recorder/mesh/gltf_file.h"

namespace flowscope {
namespace {

using nlohmann::json;

/// Applied as they are meant.
const std::set<std::string>& applied() {
  static const std::set<std::string> names{"KHR_mesh_quantization", "KHR_texture_transform",
                                           "EXT_texture_webp", "KHR_draco_mesh_compression",
                                           "EXT_mesh_gpu_instancing"};
  return names;
}

/// Known to leave the shape alone, and what is lost with them.
std::string loss_of(const std::string& name) {
  static const std::map<std::string, std::string> known{
      {"KHR_materials_pbrSpecularGlossiness",
       "of its specular-glossiness materials only the diffuse colour is taken over"},
      {"KHR_materials_unlit", "its unlit materials are drawn with light and shade"},
      {"KHR_materials_transmission", "what is see-through is drawn solid"},
      {"KHR_materials_volume", "what is see-through is drawn solid"},
      {"KHR_materials_variants", "of its material variants the default is taken"},
      {"KHR_texture_basisu", "KTX2 pictures are not read"},
      {"MSFT_texture_dds", "DDS pictures are not read"},
      {"KHR_lights_punctual", "its lights are not taken over"},
      {"MSFT_lod", "its finest level of detail is taken"},
      {"KHR_animation_pointer", "animations are not taken over"},
      {"KHR_xmp_json_ld", "its metadata are not taken over"},
      {"KHR_xmp", "its metadata are not taken over"}};
  if (const auto it = known.find(name); it != known.end()) return it->second;
  if (name.starts_with("KHR_materials_")) return "of materials only the base colour is taken over";
  return {};
}

/// Extensions that stand anywhere in the file, whether it declares them or not.
void collect(const json& node, std::set<std::string>& names, int level) {
  if (level > 32) return;
  if (node.is_object()) {
    for (const auto& [key, value] : node.items()) {
      if (key == "extensions" && value.is_object())
        for (const auto& [name, content] : value.items()) names.insert(name);
      if (key != "extras") collect(value, names, level + 1);
    }
  } else if (node.is_array()) {
    for (const json& value : node) collect(value, names, level + 1);
  }
}

}  // namespace

void check_extensions(const json& root, const TellLoss& tell) {
  for (const json& required : root.value("extensionsRequired", json::array())) {
    const auto name = required.get<std::string>();
    if (applied().contains(name) || !loss_of(name).empty()) continue;
    throw BadGltf("needs the extension " + name + ", which is not read; write the file without it");
  }
  std::set<std::string> used;
  for (const json& name : root.value("extensionsUsed", json::array())) used.insert(name.get<std::string>());
  collect(root, used, 0);
  for (const std::string& name : used) {
    if (applied().contains(name)) continue;
    const std::string loss = loss_of(name);
    tell("its extension " + name + " is not applied" + (loss.empty() ? std::string() : ": " + loss));
  }
}

void tell_losses(const json& root, const TellLoss& tell) {
  const auto has = [&](const char* list) { return root.contains(list) && !root[list].empty(); };
  if (has("animations")) tell("its animations are not taken over: the object is rigid");
  if (has("skins")) tell("its skins are not taken over: the mesh stays as it is stored");
  bool morphs = false;
  for (const json& mesh : root.value("meshes", json::array()))
    for (const json& primitive : mesh.value("primitives", json::array()))
      morphs |= primitive.contains("targets");
  if (morphs) tell("its morph targets are not taken over: the mesh stays in its first shape");
  if (has("scenes") && root["scenes"].size() > 1) tell("of its scenes only one is taken over");
  std::set<std::string> maps;
  for (const json& material : root.value("materials", json::array())) {
    for (const char* map : {"normalTexture", "occlusionTexture", "emissiveTexture"})
      if (material.contains(map)) maps.insert(map);
    if (material.value("pbrMetallicRoughness", json::object()).contains("metallicRoughnessTexture"))
      maps.insert("metallicRoughnessTexture");
    if (material.value("alphaMode", std::string("OPAQUE")) != "OPAQUE") maps.insert("alphaMode");
  }
  std::string names;
  for (const std::string& map : maps) names += (names.empty() ? "" : ", ") + map;
  if (!names.empty()) tell("of its materials only the base colour is taken over, not: " + names);
}

}  // namespace flowscope
