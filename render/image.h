// Pictures as plain values: rows top to bottom, no padding.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace flowscope {

/// 8-bit RGB, interleaved, height * width * 3 bytes, top row first.
struct ImageRgb {
  int width = 0, height = 0;
  std::vector<std::uint8_t> data;

  ImageRgb() = default;
  ImageRgb(int w, int h) : width(w), height(h), data(static_cast<std::size_t>(w) * h * 3) {}
  const std::uint8_t* at(int x, int y) const { return &data[(static_cast<std::size_t>(y) * width + x) * 3]; }
  std::uint8_t* at(int x, int y) { return &data[(static_cast<std::size_t>(y) * width + x) * 3]; }
  bool operator==(const ImageRgb&) const = default;
};

/// Depth along the camera's z axis in metres (not the range along the ray); 0 where nothing was hit.
struct DepthImage {
  int width = 0, height = 0;
  std::vector<float> data;

  DepthImage() = default;
  DepthImage(int w, int h) : width(w), height(h), data(static_cast<std::size_t>(w) * h) {}
  float at(int x, int y) const { return data[static_cast<std::size_t>(y) * width + x]; }
  float& at(int x, int y) { return data[static_cast<std::size_t>(y) * width + x]; }
  bool operator==(const DepthImage&) const = default;
};

}  // namespace flowscope
