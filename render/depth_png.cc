#include "render/depth_png.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "render/new_file.h"

namespace flowscope {

std::vector<std::uint8_t> encode_depth_png(const DepthImage& depth) {
  const std::size_t pixels = static_cast<std::size_t>(std::max(depth.width, 0)) *
                             static_cast<std::size_t>(std::max(depth.height, 0));
  if (pixels == 0 || depth.data.size() != pixels) {
    throw std::invalid_argument("encode: the depth picture is empty or torn");
  }
  cv::Mat millimetres(depth.height, depth.width, CV_16UC1);
  std::transform(depth.data.begin(), depth.data.end(), millimetres.begin<std::uint16_t>(), [](float metres) {
    return static_cast<std::uint16_t>(std::lround(std::clamp(1000.0 * metres, 0.0, 65535.0)));
  });
  std::vector<std::uint8_t> out;
  if (!cv::imencode(".png", millimetres, out)) {
    throw std::runtime_error("PNG: OpenCV could not encode the depth picture");
  }
  return out;
}

void write_depth_png(const std::filesystem::path& path, const DepthImage& depth) {
  const std::vector<std::uint8_t> bytes = encode_depth_png(depth);
  NewFile file(path);
  file.write(bytes);
  file.commit();
}

}  // namespace flowscope
