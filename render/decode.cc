#include "render/decode.h"

#include <turbojpeg.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace flowscope {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::size_t kLeast_bytes = 64;

bool is_png(Bytes bytes) {
  constexpr std::array<std::uint8_t, 8> magic{0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
  return bytes.size() >= 33 && std::equal(magic.begin(), magic.end(), bytes.begin());
}

bool is_jpeg(Bytes bytes) {
  return bytes.size() > 3 && bytes[0] == 0xFF && bytes[1] == 0xD8 && bytes[2] == 0xFF;
}

bool has(Bytes bytes, std::size_t at, std::string_view text) {
  return bytes.size() >= at + text.size() &&
         std::equal(text.begin(), text.end(), bytes.begin() + static_cast<std::ptrdiff_t>(at),
                    [](char a, std::uint8_t b) { return static_cast<std::uint8_t>(a) == b; });
}

/// A number of so many bytes, the lowest first.
long number_at(Bytes bytes, std::size_t at, std::size_t count) {
  long value = 0;
  for (std::size_t i = count; i-- > 0;) value = value << 8 | long{bytes[at + i]};
  return value;
}

/// Of its first chunk, which is one of three kinds.
std::pair<long, long> webp_size(Bytes bytes) {
  if (bytes.size() < 30) throw std::runtime_error("is a broken WebP");
  if (has(bytes, 12, "VP8X")) return {number_at(bytes, 24, 3) + 1, number_at(bytes, 27, 3) + 1};
  if (has(bytes, 12, "VP8L")) {
    const long bits = number_at(bytes, 21, 4);
    return {(bits & 0x3FFF) + 1, (bits >> 14 & 0x3FFF) + 1};
  }
  return {number_at(bytes, 26, 2) & 0x3FFF, number_at(bytes, 28, 2) & 0x3FFF};
}

/// Width and height as the file claims.
std::pair<long, long> size_of(Bytes bytes) {
  if (has(bytes, 0, "RIFF") && has(bytes, 8, "WEBP")) return webp_size(bytes);
  if (has(bytes, 0, "BM") && bytes.size() >= 54) {
    const auto height = static_cast<std::int32_t>(number_at(bytes, 22, 4));
    return {static_cast<std::int32_t>(number_at(bytes, 18, 4)), std::abs(long{height})};
  }
  if (has(bytes, 1, "KTX ")) throw std::runtime_error("is a KTX2 picture, which is not read");
  if (has(bytes, 0, "DDS ")) throw std::runtime_error("is a DDS picture, which is not read");
  if (has(bytes, 0, "GIF8")) throw std::runtime_error("is a GIF picture, which is not read");
  if (is_png(bytes)) {
    const auto number = [&](std::size_t at) {
      return long{bytes[at]} << 24 | long{bytes[at + 1]} << 16 | long{bytes[at + 2]} << 8 |
             long{bytes[at + 3]};
    };
    return {number(16), number(20)};
  }
  if (!is_jpeg(bytes)) throw std::runtime_error("is neither PNG nor JPEG nor WebP nor BMP");
  const tjhandle reader = tjInitDecompress();
  int width = 0, height = 0, sampling = 0, space = 0;
  const int failed =
      tjDecompressHeader3(reader, bytes.data(), bytes.size(), &width, &height, &sampling, &space);
  tjDestroy(reader);
  if (failed != 0) throw std::runtime_error("is a broken JPEG");
  return {width, height};
}

cv::Mat view_of(const ImageRgb& image) {
  return {image.height, image.width, CV_8UC3, const_cast<std::uint8_t*>(image.data.data())};
}

}  // namespace

ImageRgb decode_picture(Bytes bytes, int most_side_px) {
  const auto [width, height] = size_of(bytes);
  if (width < 1 || height < 1 || width > most_side_px || height > most_side_px) {
    throw std::runtime_error("is " + std::to_string(width) + "x" + std::to_string(height) +
                             " pixels; at most " + std::to_string(most_side_px) + " a side are read");
  }
  // OpenCV asks for 32 bytes of a WebP, whose smallest have fewer.
  std::vector<std::uint8_t> longer;
  if (bytes.size() < kLeast_bytes) {
    longer.assign(bytes.begin(), bytes.end());
    longer.resize(kLeast_bytes, 0);
    bytes = longer;
  }
  cv::Mat bgr;
  try {
    const cv::Mat encoded(1, static_cast<int>(bytes.size()), CV_8UC1,
                          const_cast<std::uint8_t*>(bytes.data()));
    bgr = cv::imdecode(encoded, cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception&) {
    bgr.release();
  }
  if (bgr.cols != width || bgr.rows != height) throw std::runtime_error("is broken: it can not be decoded");
  ImageRgb image(bgr.cols, bgr.rows);
  cv::Mat rgb = view_of(image);
  cv::cvtColor(bgr, rgb, cv::COLOR_BGR2RGB);
  return image;
}

ImageRgb resized(const ImageRgb& image, int width, int height) {
  ImageRgb result(width, height);
  cv::Mat target = view_of(result);
  const bool smaller = width <= image.width && height <= image.height;
  cv::resize(view_of(image), target, target.size(), 0, 0, smaller ? cv::INTER_AREA : cv::INTER_LINEAR);
  return result;
}

ImageRgb no_larger(ImageRgb image, int side_px) {
  const int longer = std::max(image.width, image.height);
  if (longer <= side_px) return image;
  const auto cut = [&](int side) {
    return std::max(1, static_cast<int>(std::lround(1.0 * side * side_px / longer)));
  };
  return resized(image, cut(image.width), cut(image.height));
}

}  // namespace flowscope
