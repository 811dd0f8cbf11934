#include "render/encode.h"

#include <turbojpeg.h>

#include <algorithm>
#include <stdexcept>
#include <string>

#include "render/new_file.h"

namespace flowscope {

namespace {

void check(const ImageRgb& image) {
  const std::size_t bytes =
      static_cast<std::size_t>(std::max(image.width, 0)) * std::max(image.height, 0) * 3;
  if (bytes == 0 || image.data.size() != bytes)
    throw std::invalid_argument("encode: the picture is empty or torn");
}

}  // namespace

JpegEncoder::JpegEncoder() : handle_(tjInitCompress()) {
  if (handle_ == nullptr) throw std::runtime_error(std::string("JPEG: ") + tjGetErrorStr2(nullptr));
}

JpegEncoder::~JpegEncoder() { tjDestroy(handle_); }

std::vector<std::uint8_t> JpegEncoder::encode(const ImageRgb& image, int quality) {
  check(image);
  std::vector<std::uint8_t> out(tjBufSize(image.width, image.height, TJSAMP_420));
  unsigned char* buffer = out.data();
  unsigned long size = out.size();
  if (tjCompress2(handle_, image.data.data(), image.width, 0, image.height, TJPF_RGB, &buffer, &size,
                  TJSAMP_420, std::clamp(quality, 1, 100), TJFLAG_NOREALLOC) != 0) {
    throw std::runtime_error(std::string("JPEG: ") + tjGetErrorStr2(handle_));
  }
  out.resize(size);
  return out;
}

void write_png(const std::filesystem::path& path, const ImageRgb& image,
               const std::function<void()>& between) {
  const std::vector<std::uint8_t> bytes = encode_png(image, between);
  NewFile file(path);
  file.write(bytes);
  file.commit();
}

}  // namespace flowscope
