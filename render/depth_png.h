// Depth as a grey 16-bit PNG, what most tools read.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "render/image.h"

namespace flowscope {

/// Millimetres along the camera's z axis, rounded; 0 where nothing was hit, 65535 for 65.535 m and farther.
/// Throws std::invalid_argument for an empty picture.
std::vector<std::uint8_t> encode_depth_png(const DepthImage& depth);
/// Whole or absent, like write_png.
void write_depth_png(const std::filesystem::path& path, const DepthImage& depth);

}  // namespace flowscope
