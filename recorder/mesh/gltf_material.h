// The looks of a glTF file's materials: base colour, picture, and how the picture lies on the mesh.
#pragma once

#include <functional>
#include <map>

#include "recorder/mesh/gltf_extensions.h"
#include "recorder/mesh/gltf_file.h"
#include "recorder/mesh/mesh.h"
#include "recorder/mesh/texture_store.h"

namespace flowscope {

struct GltfLook {
  std::array<double, 4> factor{1, 1, 1, 1};  ///< linear light
  int texture = -1;                          ///< in the store; -1: it has none, or none that can be used
  std::size_t channel = 0;                   ///< of the mesh's texture coordinates
  Eigen::Matrix2f turn = Eigen::Matrix2f::Identity();  ///< of texture coordinates, v down
  Eigen::Vector2f offset{0, 0};
  bool held_u = false, held_v = false;  ///< beyond its edges the picture's last pixels go on
  std::string name;                     ///< of the picture, for people

  /// Where a corner lies in the picture: u right, v up.
  Eigen::Vector2f place(const std::array<float, 4>& corner) const;
};

class GltfMaterials {
 public:
  /// `now_pictures` is called before the first picture is read.
  GltfMaterials(const GltfFile& file, TextureStore& store, TellLoss tell, std::function<void()> now_pictures)
      : file_(file), store_(store), tell_(std::move(tell)), now_pictures_(std::move(now_pictures)) {}
  const GltfLook& of(std::size_t material);

 private:
  GltfLook read(const nlohmann::json& material);
  void read_texture(const nlohmann::json& about, GltfLook& look);
  ImageRgb picture(const nlohmann::json& image) const;

  const GltfFile& file_;
  TextureStore& store_;
  TellLoss tell_;
  std::function<void()> now_pictures_;
  std::map<std::size_t, GltfLook> known_;
};

}  // namespace flowscope
