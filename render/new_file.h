// A file that is whole or absent: written beside its target, then moved over it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

namespace flowscope {

/// Makes missing folders. Until commit() only `temporary()` exists, and it goes with this object.
class NewFile {
 public:
  explicit NewFile(std::filesystem::path target);
  ~NewFile();
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;

  const std::filesystem::path& target() const { return target_; }
  /// Where to write: same folder, a name of its own, no usual extension.
  const std::filesystem::path& temporary() const { return temporary_; }
  void write(std::span<const std::uint8_t> bytes);
  /// Syncs the temporary file, renames it, syncs the folder. Throws std::system_error that names the path.
  void commit();

 private:
  std::filesystem::path target_, temporary_;
};

}  // namespace flowscope
