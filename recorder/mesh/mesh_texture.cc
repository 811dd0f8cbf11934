#include "recorder/mesh/mesh_texture.h"

#include <stdexcept>

namespace flowscope {
namespace {

constexpr unsigned kMost_side_px = 8192;

ImageRgb raw_picture(const aiTexture& texture) {
  if (texture.mWidth > kMost_side_px || texture.mHeight > kMost_side_px)
    throw std::runtime_error("is larger than " + std::to_string(kMost_side_px) + " pixels");
  ImageRgb image(static_cast<int>(texture.mWidth), static_cast<int>(texture.mHeight));
  for (std::size_t i = 0; 3 * i < image.data.size(); ++i) {
    const aiTexel& texel = texture.pcData[i];
    image.data[3 * i] = texel.r;
    image.data[3 * i + 1] = texel.g;
    image.data[3 * i + 2] = texel.b;
  }
  return image;
}

bool moves(const aiUVTransform& t) {
  return t.mTranslation.x != 0 || t.mTranslation.y != 0 || t.mScaling.x != 1 || t.mScaling.y != 1 ||
         t.mRotation != 0;
}

}  // namespace

MaterialTexture MaterialTextures::of(unsigned material) {
  if (material >= scene_.mNumMaterials) return {};
  const auto [at, fresh] = known_.try_emplace(material);
  if (fresh) at->second = read(*scene_.mMaterials[material]);
  return at->second;
}

MaterialTexture MaterialTextures::of(const std::string& name, const ObjMaterial& material) {
  const auto [at, fresh] = named_.try_emplace(name);
  if (fresh && !material.picture.empty()) {
    at->second.name = material.picture;
    at->second.index = store_.add(material.picture, [&] { return store_.from_file(material.picture); });
  }
  return at->second;
}

MaterialTexture MaterialTextures::read(const aiMaterial& material) {
  MaterialTexture texture;
  aiString path;
  aiTextureType found = aiTextureType_NONE;
  for (const aiTextureType type : {aiTextureType_BASE_COLOR, aiTextureType_DIFFUSE}) {
    if (found == aiTextureType_NONE && path.length == 0 &&
        material.GetTexture(type, 0, &path, nullptr, &texture.channel) == aiReturn_SUCCESS && path.length > 0)
      found = type;
  }
  if (found == aiTextureType_NONE) return {};
  texture.name = path.C_Str();
  if (texture.channel >= AI_MAX_NUMBER_OF_TEXTURECOORDS) texture.channel = 0;
  aiUVTransform transform;
  texture.moved =
      material.Get(AI_MATKEY_UVTRANSFORM(found, 0), transform) == aiReturn_SUCCESS && moves(transform);
  texture.index = store_.add(texture.name, [&] { return picture(texture.name); });
  return texture;
}

ImageRgb MaterialTextures::picture(const std::string& name) const {
  const aiTexture* inside = scene_.GetEmbeddedTexture(name.c_str());
  if (inside == nullptr) return store_.from_file(name);
  if (inside->mHeight > 0) return raw_picture(*inside);
  return store_.decode({reinterpret_cast<const std::uint8_t*>(inside->pcData), inside->mWidth});
}

}  // namespace flowscope
