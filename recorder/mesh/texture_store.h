// The pictures of one mesh file's textures, decoded, and what is told of those that could not be.
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "render/image.h"

namespace flowscope {

double to_srgb(double linear);
/// A factor in linear light, as glTF's base colour is.
void multiply(ImageRgb& image, const std::array<double, 3>& linear_factor);

/// PNG, JPEG, WebP and BMP pictures inside the file or beside it (in its folder and below, never anywhere
/// else), at most 64 MiB and 8192 pixels a side each, 64 in all; larger than 2048 pixels they are made
/// smaller.
class TextureStore {
 public:
  explicit TextureStore(std::filesystem::path folder) : folder_(std::move(folder)) {}

  /// The number of the picture that `read` gives; -1 where it throws std::runtime_error, which left_out()
  /// tells.
  int add(const std::string& name, const std::function<ImageRgb()>& read);
  ImageRgb decode(std::span<const std::uint8_t> bytes) const;
  ImageRgb from_file(const std::string& name) const;
  /// The pictures; nothing else may be asked afterwards.
  std::vector<ImageRgb> take() { return std::move(pictures_); }
  /// What could not be used: name and why.
  const std::map<std::string, std::string>& left_out() const { return left_out_; }

 private:
  std::filesystem::path folder_;
  std::map<std::string, std::string> left_out_;
  std::vector<ImageRgb> pictures_;
};

}  // namespace flowscope
