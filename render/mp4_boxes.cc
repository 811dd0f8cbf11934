#include "render/mp4_boxes.h"

#include <array>
#include <cstdint>
#include <fstream>
#include <stdexcept>
#include <string>

namespace flowscope {

namespace {

std::uint64_t big_endian(const char* bytes, int count) {
  std::uint64_t value = 0;
  for (int i = 0; i < count; ++i) value = value << 8 | static_cast<unsigned char>(bytes[i]);
  return value;
}

}  // namespace

void require_whole_mp4(const std::filesystem::path& file) {
  const auto fail = [&](const std::string& what) { throw std::runtime_error(file.string() + ": " + what); };
  const std::uint64_t size = std::filesystem::file_size(file);
  std::ifstream stream(file, std::ios::binary);
  std::string names;
  for (std::uint64_t at = 0; at < size;) {
    std::array<char, 16> head{};  // size, name, and the size once more where 32 bits do not hold it
    stream.seekg(static_cast<std::streamoff>(at));
    stream.read(head.data(), size - at < head.size() ? static_cast<std::streamsize>(size - at) : 16);
    stream.clear();
    std::uint64_t box = big_endian(head.data(), 4);
    if (box == 1) box = big_endian(head.data() + 8, 8);
    if (box < 8 || box > size - at) fail("the film is cut short");
    names += std::string(head.data() + 4, 4) + " ";
    at += box;
  }
  const auto index = names.find("moov "), frames = names.find("mdat ");
  if (index == std::string::npos || frames == std::string::npos || index > frames)
    fail("the film has no index before its frames");
}

}  // namespace flowscope
