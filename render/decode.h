// Foreign pictures in. Give bytes that nobody vouches for to a process that may be lost.
#pragma once

#include <cstdint>
#include <span>

#include "render/image.h"

namespace flowscope {

/// A PNG, JPEG, WebP or BMP as 8-bit RGB; what is see-through in it is not. Throws std::runtime_error saying
/// what is wrong; sides above `most_side_px` are refused before anything is decoded.
ImageRgb decode_picture(std::span<const std::uint8_t> bytes, int most_side_px);

/// The same picture with its longer side cut to `side_px` if that is less, each pixel the mean of those under
/// it.
ImageRgb no_larger(ImageRgb image, int side_px);
/// Stretched to a size.
ImageRgb resized(const ImageRgb& image, int width, int height);

}  // namespace flowscope
