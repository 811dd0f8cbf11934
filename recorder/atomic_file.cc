#include "recorder/atomic_file.h"

namespace flowscope {

void write_file_atomically(const std::filesystem::path& path, std::span<const std::uint8_t> bytes) {
  NewFile file(path);
  file.write(bytes);
  file.commit();
}

bool write_new_file_atomically(const std::filesystem::path& path, std::span<const std::uint8_t> bytes) {
  NewFile file(path);
  file.write(bytes);
  return file.commit_new();
}

}  // namespace flowscope
