// The base-colour textures of a mesh file's materials. For the importer only: assimp's types.
#pragma once

#include <assimp/scene.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "render/image.h"

namespace flowscope {

/// Whether a path, its links followed, ends in a folder or below it.
bool lies_below(const std::filesystem::path& folder, const std::filesystem::path& file);
double to_srgb(double linear);

struct MaterialTexture {
  int index = -1;        ///< among take(); -1: it has none, or none that can be used
  unsigned channel = 0;  ///< of the mesh's texture coordinates
};

/// PNG and JPEG pictures inside the file or beside it (in its folder and below, never anywhere else), at most
/// 64 MiB and 8192 pixels a side each, 64 in all; larger than 2048 pixels they are made smaller.
class MaterialTextures {
 public:
  /// `linear_factor`: the material's base colour is linear light and multiplies the texture, as in glTF; else
  /// it is of no account where there is a texture.
  MaterialTextures(const aiScene& scene, std::filesystem::path folder, bool linear_factor)
      : scene_(scene), folder_(std::move(folder)), linear_factor_(linear_factor) {}
  MaterialTexture of(unsigned material);
  /// The pictures; nothing else may be asked afterwards.
  std::vector<ImageRgb> take() { return std::move(pictures_); }
  /// What could not be used: name and why.
  const std::map<std::string, std::string>& left_out() const { return left_out_; }

 private:
  MaterialTexture read(const aiMaterial& material);
  ImageRgb picture(const std::string& name) const;
  std::filesystem::path find(const std::string& name) const;

  const aiScene& scene_;
  std::filesystem::path folder_;
  bool linear_factor_;
  std::map<unsigned, MaterialTexture> known_;  ///< by material
  std::map<std::string, std::string> left_out_;
  std::vector<ImageRgb> pictures_;
};

}  // namespace flowscope
