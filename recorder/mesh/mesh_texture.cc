#include "recorder/mesh/mesh_texture.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "render/decode.h"

namespace flowscope {
namespace {

constexpr std::uintmax_t kMost_bytes = 64u << 20;
constexpr std::size_t kMost_pictures = 64;
constexpr int kMost_side_px = 8192, kKept_side_px = 2048;

/// "my%20mug.png" is "my mug.png".
std::string without_escapes(const std::string& text) {
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto is_hex = [&](std::size_t k) {
      return k < text.size() && std::isxdigit(static_cast<unsigned char>(text[k]));
    };
    if (text[i] == '%' && is_hex(i + 1) && is_hex(i + 2)) {
      plain += static_cast<char>(std::stoi(text.substr(i + 1, 2), nullptr, 16));
      i += 2;
    } else {
      plain += text[i];
    }
  }
  return plain;
}

double to_linear(double srgb) {
  return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4);
}

void multiply(ImageRgb& image, const aiColor4D& linear_factor) {
  const std::array<double, 3> factor{linear_factor.r, linear_factor.g, linear_factor.b};
  std::array<std::array<std::uint8_t, 256>, 3> table{};
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t v = 0; v < 256; ++v) {
      const double shown = to_srgb(to_linear(static_cast<double>(v) / 255) * std::clamp(factor[c], 0.0, 1.0));
      table[c][v] = static_cast<std::uint8_t>(std::lround(255 * std::clamp(shown, 0.0, 1.0)));
    }
  for (std::size_t i = 0; i < image.data.size(); ++i) image.data[i] = table[i % 3][image.data[i]];
}

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

std::vector<std::uint8_t> bytes_of(const std::filesystem::path& file) {
  if (std::filesystem::file_size(file) > kMost_bytes) throw std::runtime_error("is larger than 64 MiB");
  std::ifstream stream(file, std::ios::binary);
  std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  if (!stream) throw std::runtime_error("can not be read");
  return bytes;
}

}  // namespace

bool lies_below(const std::filesystem::path& folder, const std::filesystem::path& file) {
  std::error_code error;
  const auto base = std::filesystem::weakly_canonical(folder, error);
  if (error) return false;
  const auto whole = std::filesystem::weakly_canonical(file, error);
  return !error && std::mismatch(base.begin(), base.end(), whole.begin(), whole.end()).first == base.end();
}

double to_srgb(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

MaterialTexture MaterialTextures::of(unsigned material) {
  if (material >= scene_.mNumMaterials) return {};
  const auto [at, fresh] = known_.try_emplace(material);
  if (fresh) at->second = read(*scene_.mMaterials[material]);
  return at->second;
}

MaterialTexture MaterialTextures::read(const aiMaterial& material) {
  MaterialTexture texture;
  aiString path;
  const auto named = [&](aiTextureType type) {
    return material.GetTexture(type, 0, &path, nullptr, &texture.channel) == aiReturn_SUCCESS &&
           path.length > 0;
  };
  if (!named(aiTextureType_BASE_COLOR) && !named(aiTextureType_DIFFUSE)) return {};
  const std::string name = path.C_Str();
  if (texture.channel >= AI_MAX_NUMBER_OF_TEXTURECOORDS) texture.channel = 0;
  try {
    if (pictures_.size() >= kMost_pictures) throw std::runtime_error("is one of more than 64");
    ImageRgb image = no_larger(picture(name), kKept_side_px);
    aiColor4D factor(1, 1, 1, 1);
    if (linear_factor_ && material.Get("$clr.base", 0, 0, factor) == aiReturn_SUCCESS &&
        std::min({factor.r, factor.g, factor.b}) < 1)
      multiply(image, factor);
    texture.index = static_cast<int>(pictures_.size());
    pictures_.push_back(std::move(image));
  } catch (const std::runtime_error& error) {
    left_out_.emplace(name, error.what());
    return {};
  }
  return texture;
}

ImageRgb MaterialTextures::picture(const std::string& name) const {
  const aiTexture* inside = scene_.GetEmbeddedTexture(name.c_str());
  if (inside != nullptr) {
    if (inside->mHeight > 0) return raw_picture(*inside);
    if (inside->mWidth > kMost_bytes) throw std::runtime_error("is larger than 64 MiB");
    return decode_picture({reinterpret_cast<const std::uint8_t*>(inside->pcData), inside->mWidth},
                          kMost_side_px);
  }
  return decode_picture(bytes_of(find(name)), kMost_side_px);
}

/// Exporters write paths of their own machine: the file's bare name beside the mesh will do as well.
std::filesystem::path MaterialTextures::find(const std::string& name) const {
  if (name.find("://") != std::string::npos)
    throw std::runtime_error("lies elsewhere; only files beside the mesh are read");
  bool outside = false;
  for (std::string text : {name, without_escapes(name)}) {
    std::ranges::replace(text, '\\', '/');
    const std::filesystem::path path(text);
    for (const auto& file : {folder_ / path, folder_ / path.filename()}) {
      std::error_code error;
      if (!std::filesystem::is_regular_file(file, error)) continue;
      if (lies_below(folder_, file)) return file;
      outside = true;
    }
  }
  throw std::runtime_error(outside ? "lies elsewhere; only files beside the mesh are read"
                                   : "is not there: no such file beside the mesh");
}

}  // namespace flowscope
