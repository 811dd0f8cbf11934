#include "recorder/mesh/gltf_material.h"

#include <algorithm>
#include <cmath>

namespace flowscope {
namespace {

using nlohmann::json;

constexpr int kClamp_to_edge = 33071, kMirrored_repeat = 33648;

json part(const json& object, const char* key) { return object.value(key, json::object()); }

Eigen::Vector2f pair_of(const json& object, const char* key, float otherwise) {
  const auto values = object.value(key, std::array<float, 2>{otherwise, otherwise});
  return {values[0], values[1]};
}

/// The picture and its mirror image, which repeat as the mirrored one would.
ImageRgb with_mirror(const ImageRgb& image, bool along_u, bool along_v) {
  ImageRgb both(image.width * (along_u ? 2 : 1), image.height * (along_v ? 2 : 1));
  for (int y = 0; y < both.height; ++y)
    for (int x = 0; x < both.width; ++x)
      std::copy_n(
          image.at(x < image.width ? x : both.width - 1 - x, y < image.height ? y : both.height - 1 - y), 3,
          both.at(x, y));
  return both;
}

}  // namespace

Eigen::Vector2f GltfLook::place(const std::array<float, 4>& corner) const {
  const Eigen::Vector2f at = turn * Eigen::Vector2f(corner[0], corner[1]) + offset;
  return {at.x(), 1 - at.y()};
}

const GltfLook& GltfMaterials::of(std::size_t material) {
  const auto [at, fresh] = known_.try_emplace(material);
  if (fresh) at->second = read(file_.entry("materials", material));
  return at->second;
}

GltfLook GltfMaterials::read(const json& material) {
  GltfLook look;
  const json specular = part(part(material, "extensions"), "KHR_materials_pbrSpecularGlossiness");
  const json metallic = part(material, "pbrMetallicRoughness");
  const bool old = !specular.empty();
  look.factor =
      old ? specular.value("diffuseFactor", look.factor) : metallic.value("baseColorFactor", look.factor);
  const json texture = part(old ? specular : metallic, old ? "diffuseTexture" : "baseColorTexture");
  if (!texture.empty()) read_texture(texture, look);
  return look;
}

void GltfMaterials::read_texture(const json& about, GltfLook& look) {
  const json& texture = file_.entry("textures", about.at("index").get<std::size_t>());
  const json extensions = part(texture, "extensions");
  json source;
  for (const json& holder : {part(extensions, "EXT_texture_webp"), texture})
    if (source.is_null() && holder.contains("source")) source = holder["source"];
  for (const auto& [name, extension] :
       extensions.items())  // one that is not read: its picture's name is told
    if (source.is_null() && extension.contains("source")) source = extension["source"];
  if (source.is_null())
    return tell_("one of its textures has no picture; the material's plain colour is used");
  const json& image = file_.entry("images", source.get<std::size_t>());
  const std::string uri = image.value("uri", std::string());
  look.name = uri.empty() || uri.starts_with("data:")
                  ? image.value("name", "image " + std::to_string(source.get<std::size_t>()))
                  : uri;

  const json sampler = texture.contains("sampler")
                           ? file_.entry("samplers", texture["sampler"].get<std::size_t>())
                           : json::object();
  const int wrap_u = sampler.value("wrapS", 10497), wrap_v = sampler.value("wrapT", 10497);
  const bool mirror_u = wrap_u == kMirrored_repeat, mirror_v = wrap_v == kMirrored_repeat;
  look.held_u = wrap_u == kClamp_to_edge, look.held_v = wrap_v == kClamp_to_edge;
  look.channel = about.value("texCoord", std::size_t{0});
  const json transform = part(part(about, "extensions"), "KHR_texture_transform");
  look.channel = transform.value("texCoord", look.channel);
  const float angle = transform.value("rotation", 0.0f);
  const Eigen::Vector2f scale = pair_of(transform, "scale", 1);
  look.turn << std::cos(angle), std::sin(angle), -std::sin(angle),
      std::cos(angle);  // counter-clockwise, v down
  look.turn = (look.turn * scale.asDiagonal()).eval();
  look.offset = pair_of(transform, "offset", 0);
  const Eigen::Vector2f shrink(mirror_u ? 0.5f : 1.0f, mirror_v ? 0.5f : 1.0f);
  look.turn = (shrink.asDiagonal() * look.turn).eval();
  look.offset = shrink.cwiseProduct(look.offset);

  if (now_pictures_) now_pictures_();
  look.texture = store_.add(look.name, [&] {
    ImageRgb read = picture(image);
    if (*std::min_element(look.factor.begin(), look.factor.begin() + 3) < 1)
      multiply(read, {look.factor[0], look.factor[1], look.factor[2]});
    return mirror_u || mirror_v ? with_mirror(read, mirror_u, mirror_v) : read;
  });
}

ImageRgb GltfMaterials::picture(const json& image) const {
  if (image.contains("bufferView")) return store_.decode(file_.view(image["bufferView"].get<std::size_t>()));
  const auto uri = image.at("uri").get<std::string>();
  return uri.starts_with("data:") ? store_.decode(bytes_of_data_uri(uri)) : store_.from_file(uri);
}

}  // namespace flowscope
