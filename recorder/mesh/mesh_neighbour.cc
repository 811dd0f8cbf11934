#include "recorder/mesh/mesh_neighbour.h"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace flowscope {
namespace {

/// "my%20mug.png" is "my mug.png".
std::string without_escapes(const std::string& text) {
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto is_hex = [&](std::size_t k) {
      return k < text.size() && std::isxdigit(static_cast<unsigned char>(text[k]));
    };
    if (text[i] == '%' && is_hex(i + 1) && is_hex(i + 2)) {
      plain += static_cast<char>(std::stoi(text.substr(i + 1, 2), nullptr, 16));
      i += 2;
    } else {
      plain += text[i];
    }
  }
  return plain;
}

}  // namespace

bool lies_below(const std::filesystem::path& folder, const std::filesystem::path& file) {
  std::error_code error;
  const auto base = std::filesystem::weakly_canonical(folder, error);
  if (error) return false;
  const auto whole = std::filesystem::weakly_canonical(file, error);
  return !error && std::mismatch(base.begin(), base.end(), whole.begin(), whole.end()).first == base.end();
}

std::filesystem::path neighbour(const std::filesystem::path& folder, const std::string& name) {
  if (name.find("://") != std::string::npos)
    throw std::runtime_error("lies elsewhere; only files beside the mesh are read");
  bool outside = false;
  for (std::string text : {name, without_escapes(name)}) {
    std::ranges::replace(text, '\\', '/');
    const std::filesystem::path path(text);
    for (const auto& file : {folder / path, folder / path.filename()}) {
      std::error_code error;
      if (!std::filesystem::is_regular_file(file, error)) continue;
      if (lies_below(folder, file)) return file;
      outside = true;
    }
  }
  throw std::runtime_error(outside ? "lies elsewhere; only files beside the mesh are read"
                                   : "is not there: no such file beside the mesh");
}

std::vector<std::uint8_t> bytes_of(const std::filesystem::path& file, std::uintmax_t most_mib) {
  if (std::filesystem::file_size(file) > most_mib << 20)
    throw std::runtime_error("is larger than " + std::to_string(most_mib) + " MiB");
  std::ifstream stream(file, std::ios::binary);
  std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  if (!stream) throw std::runtime_error("can not be read");
  return bytes;
}

}  // namespace flowscope
