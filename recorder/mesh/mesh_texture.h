// The base-colour textures of the materials that assimp has read. For the importer only: assimp's types.
#pragma once

#include <assimp/scene.h>

#include <map>
#include <string>

#include "recorder/mesh/obj_materials.h"
#include "recorder/mesh/texture_store.h"

namespace flowscope {

struct MaterialTexture {
  int index = -1;        ///< in the store; -1: it has none, or none that can be used
  unsigned channel = 0;  ///< of the mesh's texture coordinates
  std::string name;      ///< for people
  bool moved = false;    ///< the file says how it is moved or scaled on the surface, in assimp's terms
};

class MaterialTextures {
 public:
  MaterialTextures(const aiScene& scene, TextureStore& store) : scene_(scene), store_(store) {}
  MaterialTexture of(unsigned material);
  /// The same by the material of an OBJ file, whose options assimp skips.
  MaterialTexture of(const std::string& name, const ObjMaterial& material);

 private:
  MaterialTexture read(const aiMaterial& material);
  ImageRgb picture(const std::string& name) const;

  const aiScene& scene_;
  TextureStore& store_;
  std::map<unsigned, MaterialTexture> known_;  ///< by material
  std::map<std::string, MaterialTexture> named_;
};

}  // namespace flowscope
