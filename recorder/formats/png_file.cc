#include "recorder/formats/png_file.h"

#include <png.h>

#include <stdexcept>
#include <string>

namespace flowscope {
namespace {

/// libpng's plain interface keeps its state and its complaint in one struct.
class Png {
 public:
  Png() { image_.version = PNG_IMAGE_VERSION; }
  ~Png() { png_image_free(&image_); }
  Png(const Png&) = delete;
  Png& operator=(const Png&) = delete;
  png_image* get() { return &image_; }
  png_image* operator->() { return &image_; }
  [[noreturn]] void fail() const { throw std::runtime_error(image_.message); }

 private:
  png_image image_{};
};

}  // namespace

Bytes png_of(const ImageRgb& image) {
  Png png;
  png->width = static_cast<png_uint_32>(image.width);
  png->height = static_cast<png_uint_32>(image.height);
  png->format = PNG_FORMAT_RGB;
  Bytes bytes(PNG_IMAGE_PNG_SIZE_MAX(*png.get()));
  png_alloc_size_t size = bytes.size();
  if (png_image_write_to_memory(png.get(), bytes.data(), &size, 0, image.data.data(), 0, nullptr) == 0)
    png.fail();
  bytes.resize(size);
  return bytes;
}

ImageRgb image_of_png(std::span<const std::uint8_t> bytes, int width, int height) {
  Png png;
  if (png_image_begin_read_from_memory(png.get(), bytes.data(), bytes.size()) == 0) png.fail();
  if (png->format != PNG_FORMAT_RGB) throw std::runtime_error("is not an 8-bit RGB picture");
  if (static_cast<int>(png->width) != width || static_cast<int>(png->height) != height) {
    throw std::runtime_error("is " + std::to_string(png->width) + "x" + std::to_string(png->height) +
                             ", not " + std::to_string(width) + "x" + std::to_string(height) + " pixels");
  }
  ImageRgb image(width, height);
  if (png_image_finish_read(png.get(), nullptr, image.data.data(), 0, nullptr) == 0) png.fail();
  if ((png->warning_or_error & PNG_IMAGE_WARNING) != 0)
    png.fail();  // a checksum that does not match, among others
  return image;
}

}  // namespace flowscope
