// Primitives of glTF files that Draco has compressed.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace flowscope {

struct DracoPrimitive {
  std::vector<std::uint32_t> indices;
  std::map<std::string, std::vector<std::array<float, 4>>> attributes;  ///< what they lack is 0, the fourth 1
  std::map<std::string, std::size_t> widths;
};

/// `ids`: what Draco calls each attribute. Throws BadGltf.
DracoPrimitive decode_draco(std::span<const std::uint8_t> bytes,
                            const std::map<std::string, std::uint32_t>& ids);

}  // namespace flowscope
