// PNG row by row, so that a large picture can be given up half-way.
#include <zlib.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string_view>

#include "render/encode.h"

namespace flowscope {

namespace {

constexpr int rows_at_once = 32;

void put_number(std::vector<std::uint8_t>& out, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) out.push_back(static_cast<std::uint8_t>(value >> shift));
}

void put_chunk(std::vector<std::uint8_t>& out, std::string_view kind,
               const std::vector<std::uint8_t>& content) {
  put_number(out, static_cast<std::uint32_t>(content.size()));
  const std::size_t begin = out.size();
  out.insert(out.end(), kind.begin(), kind.end());
  out.insert(out.end(), content.begin(), content.end());
  put_number(
      out, static_cast<std::uint32_t>(::crc32(0, out.data() + begin, static_cast<uInt>(out.size() - begin))));
}

/// zlib with the settings for speed that picture libraries use; what it makes is drained after every input.
class Deflate {
 public:
  Deflate() {
    if (::deflateInit2(&stream_, Z_BEST_SPEED, Z_DEFLATED, MAX_WBITS, 9, Z_RLE) != Z_OK)
      throw std::runtime_error("PNG: zlib could not start");
  }
  ~Deflate() { ::deflateEnd(&stream_); }
  Deflate(const Deflate&) = delete;
  Deflate& operator=(const Deflate&) = delete;

  void add(std::vector<std::uint8_t>& input, bool last, std::vector<std::uint8_t>& out) {
    stream_.next_in = input.data();
    stream_.avail_in = static_cast<uInt>(input.size());
    do {
      stream_.next_out = buffer_.data();
      stream_.avail_out = static_cast<uInt>(buffer_.size());
      if (::deflate(&stream_, last ? Z_FINISH : Z_NO_FLUSH) == Z_STREAM_ERROR)
        throw std::runtime_error("PNG: zlib failed");
      out.insert(out.end(), buffer_.data(), buffer_.data() + (buffer_.size() - stream_.avail_out));
    } while (stream_.avail_out == 0);
  }

 private:
  z_stream stream_{};
  std::array<std::uint8_t, 64 * 1024> buffer_{};
};

/// Filter 1: every byte less the one of the pixel to its left.
void put_row(std::vector<std::uint8_t>& out, const ImageRgb& image, int y) {
  const std::uint8_t* row = image.at(0, y);
  out.push_back(1);
  out.insert(out.end(), row, row + 3);
  for (int i = 3; i < 3 * image.width; ++i) out.push_back(static_cast<std::uint8_t>(row[i] - row[i - 3]));
}

}  // namespace

std::vector<std::uint8_t> encode_png(const ImageRgb& image, const std::function<void()>& between) {
  const auto pixels = static_cast<std::size_t>(image.width > 0 ? image.width : 0) *
                      static_cast<std::size_t>(image.height > 0 ? image.height : 0);
  if (pixels == 0 || image.data.size() != 3 * pixels)
    throw std::invalid_argument("encode: the picture is empty or torn");
  std::vector<std::uint8_t> out{0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
  std::vector<std::uint8_t> head;
  put_number(head, static_cast<std::uint32_t>(image.width));
  put_number(head, static_cast<std::uint32_t>(image.height));
  head.insert(head.end(), {8, 2, 0, 0, 0});  // 8 bits, RGB, deflate, filters per row, not interlaced
  put_chunk(out, "IHDR", head);
  Deflate deflate;
  std::vector<std::uint8_t> rows, packed;
  for (int y = 0; y < image.height; y += rows_at_once) {
    if (between) between();
    rows.clear();
    packed.clear();
    const int end = std::min(image.height, y + rows_at_once);
    for (int row = y; row < end; ++row) put_row(rows, image, row);
    deflate.add(rows, end == image.height, packed);
    if (!packed.empty()) put_chunk(out, "IDAT", packed);
  }
  put_chunk(out, "IEND", {});
  return out;
}

}  // namespace flowscope
