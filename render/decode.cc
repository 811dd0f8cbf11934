#include "render/decode.h"

#include <turbojpeg.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>
#include <utility>

namespace flowscope {
namespace {

using Bytes = std::span<const std::uint8_t>;

bool is_png(Bytes bytes) {
  constexpr std::array<std::uint8_t, 8> magic{0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
  return bytes.size() >= 33 && std::equal(magic.begin(), magic.end(), bytes.begin());
}

bool is_jpeg(Bytes bytes) {
  return bytes.size() > 3 && bytes[0] == 0xFF && bytes[1] == 0xD8 && bytes[2] == 0xFF;
}

/// Width and height as the file claims.
std::pair<long, long> size_of(Bytes bytes) {
  if (is_png(bytes)) {
    const auto number = [&](std::size_t at) {
      return long{bytes[at]} << 24 | long{bytes[at + 1]} << 16 | long{bytes[at + 2]} << 8 |
             long{bytes[at + 3]};
    };
    return {number(16), number(20)};
  }
  if (!is_jpeg(bytes)) throw std::runtime_error("is neither PNG nor JPEG");
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
