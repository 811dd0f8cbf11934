#include "recorder/mesh/stl_bytes.h"

#include <algorithm>
#include <cctype>
#include <cstring>
#include <string_view>

namespace flowscope {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::size_t kHead = 84, kTriangle = 50;

/// Of a binary file, by the number that its head claims.
std::size_t binary_size(const Bytes& bytes) {
  std::uint32_t count = 0;
  if (bytes.size() < kHead) return 0;
  std::memcpy(&count, bytes.data() + 80, 4);
  return kHead + kTriangle * std::size_t{count};
}

bool starts_as_text(const Bytes& bytes) {
  std::size_t at = 0;
  while (at < bytes.size() && std::isspace(bytes[at])) ++at;
  const std::string_view solid = "solid";
  return bytes.size() - at >= solid.size() &&
         std::equal(solid.begin(), solid.end(), bytes.begin() + static_cast<std::ptrdiff_t>(at),
                    [](char a, std::uint8_t b) { return a == std::tolower(b); });
}

}  // namespace

Bytes sound_stl(Bytes bytes, const std::function<void(const std::string&)>& tell) {
  const auto cut = [&](std::size_t size) {
    if (size >= bytes.size()) return;
    const bool blank = std::all_of(bytes.begin() + static_cast<std::ptrdiff_t>(size), bytes.end(),
                                   [](std::uint8_t c) { return c == 0 || std::isspace(c); });
    if (!blank)
      tell("the " + std::to_string(bytes.size() - size) + " bytes after its last triangle are not read");
    bytes.resize(size);
  };
  const std::size_t binary = binary_size(bytes);
  if (!starts_as_text(bytes) || binary == bytes.size()) {
    if (binary > kHead && binary < bytes.size()) cut(binary);
    return bytes;
  }
  Bytes lower = bytes;
  std::ranges::transform(lower, lower.begin(),
                         [](std::uint8_t c) { return static_cast<std::uint8_t>(std::tolower(c)); });
  const std::string_view text(reinterpret_cast<const char*>(lower.data()), lower.size());
  if (text.find("facet") == std::string_view::npos) {  // a binary file may be called solid
    if (binary > kHead && binary < bytes.size()) cut(binary);
    return bytes;
  }
  bytes = std::move(lower);
  const auto end = text.rfind("endsolid");
  if (end != std::string_view::npos) {
    const auto line =
        std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()).find('\n', end);
    if (line != std::string_view::npos) cut(line + 1);
  }
  return bytes;
}

}  // namespace flowscope
