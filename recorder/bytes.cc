#include "recorder/bytes.h"

#include <zlib.h>

namespace flowscope {

Bytes deflate_bytes(std::span<const std::uint8_t> raw) {
  uLongf size = compressBound(raw.size());
  Bytes packed(size);
  if (compress2(packed.data(), &size, raw.data(), raw.size(), 6) != Z_OK) {
    throw std::runtime_error("compression failed");
  }
  packed.resize(size);
  return packed;
}

Bytes inflate_bytes(std::span<const std::uint8_t> packed, std::size_t raw_size) {
  Bytes raw(raw_size);
  std::uint8_t none = 0;
  uLongf size = raw_size;
  const int result = uncompress(raw.empty() ? &none : raw.data(), &size, packed.data(), packed.size());
  if (result != Z_OK || size != raw_size) throw std::runtime_error("compressed block is damaged");
  return raw;
}

}  // namespace flowscope
