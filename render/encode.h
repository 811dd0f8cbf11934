// Pictures out: JPEG (TurboJPEG), PNG and MP4 (H.264, yuv420p, index at the front). Foreign pictures are
// decoded by decode.h alone.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <stop_token>
#include <vector>

#include "render/image.h"

namespace flowscope {

/// Reuses its compressor and buffer; one per thread.
class JpegEncoder {
 public:
  JpegEncoder();
  ~JpegEncoder();
  std::vector<std::uint8_t> encode(const ImageRgb& image, int quality = 80);

 private:
  void* handle_;
};

/// `between` is called every few rows; what it throws ends the work.
std::vector<std::uint8_t> encode_png(const ImageRgb& image, const std::function<void()>& between = {});
/// Written beside the target under a temporary name, synced, renamed. Throws std::runtime_error naming the
/// path.
void write_png(const std::filesystem::path& path, const ImageRgb& image,
               const std::function<void()>& between = {});

/// Frames of one size, in order. `finish()` makes the file appear under its name; without it nothing remains.
/// Once `stop` is asked for, add() and finish() throw within 20 ms, also while the encoder is busy.
class Mp4Writer {
 public:
  Mp4Writer(const std::filesystem::path& path, int width, int height, double fps, std::stop_token stop = {});
  ~Mp4Writer();
  void add(const ImageRgb& frame);
  void finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace flowscope
