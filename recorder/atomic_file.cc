#include "recorder/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <random>
#include <string>
#include <string_view>
#include <system_error>

namespace flowscope {
namespace {

constexpr std::string_view temporary_prefix = ".flowscope-tmp-";

[[noreturn]] void throw_errno(int error, const std::string& what) {
  throw std::system_error(error, std::generic_category(), what);
}

std::filesystem::path folder_of(const std::filesystem::path& path) {
  return path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
}

/// False when `to` exists; errno says why it failed otherwise.
bool rename_to_free(const std::filesystem::path& from, const std::filesystem::path& to) {
  if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return true;
  // Some file systems know no such rename; a hard link does not replace either.
  if ((errno == EINVAL || errno == ENOSYS) && ::link(from.c_str(), to.c_str()) == 0) {
    ::unlink(from.c_str());
    return true;
  }
  if (errno == EEXIST) return false;
  throw_errno(errno, "cannot write " + to.string());
}

/// A written and synced file that vanishes unless it is given its final name.
class TemporaryFile {
 public:
  TemporaryFile(const std::filesystem::path& target, std::span<const std::uint8_t> bytes) : target_(target) {
    std::random_device random;
    do {
      path_ = folder_of(target) /
              (std::string(temporary_prefix) + std::to_string(::getpid()) + "-" + std::to_string(random()));
      file_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
    } while (file_ < 0 && errno == EEXIST);
    if (file_ < 0) throw_errno(errno, "cannot write " + target_.string());
    try {
      write(bytes);
    } catch (...) {
      discard();
      throw;
    }
  }
  ~TemporaryFile() { discard(); }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  void replace_target() {
    if (::rename(path_.c_str(), target_.c_str()) != 0) throw_errno(errno, "cannot write " + target_.string());
    path_.clear();
  }

  /// False when the target exists.
  bool become_target() {
    if (!rename_to_free(path_, target_)) return false;
    path_.clear();
    return true;
  }

 private:
  void write(std::span<const std::uint8_t> bytes) {
    while (!bytes.empty()) {
      const ssize_t written = ::write(file_, bytes.data(), bytes.size());
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) throw_errno(errno, "cannot write " + target_.string());
      bytes = bytes.subspan(static_cast<std::size_t>(written));
    }
    if (::fsync(file_) != 0) throw_errno(errno, "cannot sync " + target_.string());
    const int closed = ::close(file_);
    file_ = -1;
    if (closed != 0) throw_errno(errno, "cannot write " + target_.string());
  }

  void discard() noexcept {
    if (file_ >= 0) ::close(file_);
    file_ = -1;
    if (!path_.empty()) ::unlink(path_.c_str());
    path_.clear();
  }

  std::filesystem::path target_, path_;
  int file_ = -1;
};

/// Without this the new name may be lost with the power.
void sync_folder(const std::filesystem::path& path) {
  const std::filesystem::path folder = folder_of(path);
  const int file = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (file < 0) throw_errno(errno, "cannot sync folder " + folder.string());
  const int result = ::fsync(file);
  const int error = errno;
  ::close(file);
  // A file system that cannot sync folders says EINVAL; it orders renames by itself.
  if (result != 0 && error != EINVAL) throw_errno(error, "cannot sync folder " + folder.string());
}

}  // namespace

void write_file_atomically(const std::filesystem::path& path, std::span<const std::uint8_t> bytes) {
  TemporaryFile file(path, bytes);
  file.replace_target();
  sync_folder(path);
}

bool write_new_file_atomically(const std::filesystem::path& path, std::span<const std::uint8_t> bytes) {
  TemporaryFile file(path, bytes);
  if (!file.become_target()) return false;
  sync_folder(path);
  return true;
}

bool move_to_new_name(const std::filesystem::path& from, const std::filesystem::path& to) {
  if (!rename_to_free(from, to)) return false;
  sync_folder(to);
  sync_folder(from);
  return true;
}

void remove_stale_temporaries(const std::filesystem::path& folder, std::chrono::seconds age) noexcept {
  try {
    const auto oldest = std::filesystem::file_time_type::clock::now() - age;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      std::error_code ignored;
      if (entry.path().filename().string().starts_with(temporary_prefix) &&
          entry.last_write_time(ignored) <= oldest) {
        std::filesystem::remove(entry.path(), ignored);
      }
    }
  } catch (const std::exception&) {
    return;  // a folder that cannot be read is reported by whoever needs its content
  }
}

}  // namespace flowscope
