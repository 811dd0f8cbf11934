// A full disk, in two ways: a limit on the size of files, which anybody may set, and a real file system of a
// few pages, which only root may mount.
#pragma once

#include <fcntl.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <string>

namespace flowscope::testing {

/// As long as it lives, no file of this process and of those that it starts grows above `bytes`.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(std::uint64_t bytes) : signal_before_(std::signal(SIGXFSZ, SIG_IGN)) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    rlimit now = before_;
    now.rlim_cur = bytes;
    if (::setrlimit(RLIMIT_FSIZE, &now) != 0) throw std::runtime_error("no limit on the size of files");
  }
  ~FileSizeLimit() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, signal_before_);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit before_{};
  void (*signal_before_)(int);
};

/// A file system in memory that this thread, and programs that it starts, see at `place`. Once there is one,
/// the thread keeps a list of mounts of its own.
class SmallDisk {
 public:
  static constexpr std::uint64_t page = 4096;

  explicit SmallDisk(std::filesystem::path place) : place_(std::move(place)) {
    std::filesystem::create_directories(place_);
    mounted_ = ::unshare(CLONE_NEWNS) == 0 &&
               ::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
               ::mount("none", place_.c_str(), "tmpfs", 0, "size=64m") == 0;
    if (!mounted_) why_not_ = std::string("no small disk can be mounted here: ") + std::strerror(errno);
  }
  ~SmallDisk() {
    if (mounted_) ::umount2(place_.c_str(), MNT_DETACH);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;

  /// Why there is none; empty when there is.
  const std::string& why_not() const { return why_not_; }

  /// So many pages are free from now on.
  void leave(std::uint64_t pages) {
    const auto ballast = place_ / ".ballast";
    std::filesystem::remove(ballast);
    struct statvfs now {};
    ::statvfs(place_.c_str(), &now);
    const int file = ::open(ballast.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
    const auto bytes = static_cast<off_t>((now.f_bfree - pages) * page);
    const int error = bytes > 0 ? ::posix_fallocate(file, 0, bytes) : 0;
    ::close(file);
    if (error != 0) throw std::runtime_error(std::string("no ballast: ") + std::strerror(error));
  }

 private:
  std::filesystem::path place_;
  bool mounted_ = false;
  std::string why_not_;
};

}  // namespace flowscope::testing
