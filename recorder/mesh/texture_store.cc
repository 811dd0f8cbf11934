#include "recorder/mesh/texture_store.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "recorder/mesh/mesh_neighbour.h"
#include "render/decode.h"

namespace flowscope {
namespace {

constexpr std::uintmax_t kMost_mib = 64;
constexpr std::size_t kMost_pictures = 64;
constexpr int kMost_side_px = 8192, kKept_side_px = 2048;

double to_linear(double srgb) {
  return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4);
}

}  // namespace

double to_srgb(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

void multiply(ImageRgb& image, const std::array<double, 3>& linear_factor) {
  std::array<std::array<std::uint8_t, 256>, 3> table{};
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t v = 0; v < 256; ++v) {
      const double factor = std::clamp(linear_factor[c], 0.0, 1.0);
      const double shown = to_srgb(to_linear(static_cast<double>(v) / 255) * factor);
      table[c][v] = static_cast<std::uint8_t>(std::lround(255 * std::clamp(shown, 0.0, 1.0)));
    }
  for (std::size_t i = 0; i < image.data.size(); ++i) image.data[i] = table[i % 3][image.data[i]];
}

int TextureStore::add(const std::string& name, const std::function<ImageRgb()>& read) {
  try {
    if (pictures_.size() >= kMost_pictures) throw std::runtime_error("is one of more than 64");
    pictures_.push_back(no_larger(read(), kKept_side_px));
    return static_cast<int>(pictures_.size()) - 1;
  } catch (const std::runtime_error& error) {
    left_out_.emplace(name, error.what());
    return -1;
  }
}

ImageRgb TextureStore::decode(std::span<const std::uint8_t> bytes) const {
  if (bytes.size() > kMost_mib << 20) throw std::runtime_error("is larger than 64 MiB");
  return decode_picture(bytes, kMost_side_px);
}

ImageRgb TextureStore::from_file(const std::string& name) const {
  return decode(bytes_of(neighbour(folder_, name), kMost_mib));
}

}  // namespace flowscope
