// Moving pictures without a renderer: a table, a turning arm and a perception sphere, as RGB, JPEG and PNG.
#pragma once

#include <turbojpeg.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "render/image.h"

namespace flowscope::testing {

/// `phase` turns the arm; `tint` tells cameras apart; with a radius in (0, 1] a sphere is drawn around the
/// hand.
inline ImageRgb draw_scene(int width, int height, double phase, std::uint8_t tint, double radius = 0) {
  ImageRgb image(width, height);
  const double hand_x = 0.5 + 0.25 * std::cos(phase), hand_y = 0.45 + 0.12 * std::sin(phase);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double u = (x + 0.5) / width, v = (y + 0.5) / height;
      const double aspect = static_cast<double>(width) / height;
      const double from_hand = std::hypot((u - hand_x) * aspect, v - hand_y);
      // Distance to the segment from the base to the hand.
      const double bx = 0.5, by = 0.95, dx = hand_x - bx, dy = hand_y - by;
      const double along = std::clamp(((u - bx) * dx + (v - by) * dy) / (dx * dx + dy * dy), 0.0, 1.0);
      const double from_arm = std::hypot((u - bx - along * dx) * aspect, v - by - along * dy);
      std::uint8_t* pixel = image.at(x, y);
      const auto shade = static_cast<std::uint8_t>(60 + 120 * v);
      pixel[0] = shade, pixel[1] = static_cast<std::uint8_t>(shade - tint / 4),
      pixel[2] = static_cast<std::uint8_t>(shade + tint / 8);
      if (v > 0.6) pixel[0] = 150, pixel[1] = 120, pixel[2] = 90;
      if (from_arm < 0.02) pixel[0] = pixel[1] = pixel[2] = 230;
      if (from_hand < 0.03) pixel[0] = 220, pixel[1] = 60, pixel[2] = 50;
      if (radius > 0 && std::abs(from_hand - 0.4 * radius) < 0.006)
        pixel[0] = 60, pixel[1] = 200, pixel[2] = 220;
    }
  }
  return image;
}

inline std::vector<std::uint8_t> fake_jpeg(const ImageRgb& image) {
  tjhandle compressor = tjInitCompress();
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  const int failure = tjCompress2(compressor, image.data.data(), image.width, 0, image.height, TJPF_RGB,
                                  &bytes, &size, TJSAMP_420, 80, TJFLAG_FASTDCT);
  std::vector<std::uint8_t> jpeg;
  if (!failure) jpeg.assign(bytes, bytes + size);
  tjFree(bytes);
  tjDestroy(compressor);
  if (failure) throw std::runtime_error("no JPEG");
  return jpeg;
}

inline std::vector<std::uint8_t> fake_png(const ImageRgb& image) {
  std::vector<std::uint8_t> png{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  const auto number = [](std::vector<std::uint8_t>& out, std::uint32_t n) {
    for (int shift = 24; shift >= 0; shift -= 8) out.push_back(static_cast<std::uint8_t>(n >> shift));
  };
  const auto chunk = [&](const std::string& type, const std::vector<std::uint8_t>& data) {
    std::vector<std::uint8_t> body(type.begin(), type.end());
    body.insert(body.end(), data.begin(), data.end());
    number(png, static_cast<std::uint32_t>(data.size()));
    png.insert(png.end(), body.begin(), body.end());
    number(png, static_cast<std::uint32_t>(crc32(0, body.data(), static_cast<uInt>(body.size()))));
  };
  std::vector<std::uint8_t> header;
  number(header, static_cast<std::uint32_t>(image.width));
  number(header, static_cast<std::uint32_t>(image.height));
  header.insert(header.end(), {8, 2, 0, 0, 0});
  std::vector<std::uint8_t> rows;
  for (int y = 0; y < image.height; ++y) {
    rows.push_back(0);
    rows.insert(rows.end(), image.at(0, y), image.at(0, y) + std::size_t{3} * image.width);
  }
  uLongf size = compressBound(rows.size());
  std::vector<std::uint8_t> packed(size);
  compress2(packed.data(), &size, rows.data(), rows.size(), 1);
  packed.resize(size);
  chunk("IHDR", header);
  chunk("IDAT", packed);
  chunk("IEND", {});
  return png;
}

}  // namespace flowscope::testing
