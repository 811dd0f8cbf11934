// PNG pictures, written and read without loss. 8-bit RGB only.
#pragma once

#include <span>

#include "recorder/bytes.h"
#include "render/image.h"

namespace flowscope {

Bytes png_of(const ImageRgb& image);

/// Throws std::runtime_error saying what is wrong when the bytes are not a whole 8-bit RGB PNG of exactly
/// this size; nothing is allocated before the size has been compared.
ImageRgb image_of_png(std::span<const std::uint8_t> bytes, int width, int height);

}  // namespace flowscope
