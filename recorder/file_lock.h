// One program at a time on one thing, and the second is told who the first is.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>

namespace flowscope {

/// Somebody else has it; what() names the program, its process and since when.
class LockedByOther : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// An exclusive flock on a file that says who holds it. The kernel lets go when the process ends, however it
/// ends, so what a killed program leaves behind is no obstacle. Takers exclude each other within one process
/// too.
class FileLock {
 public:
  /// `path` is the lock's own file, made when missing; `thing` and `command` are words for the message of
  /// whoever comes second. Throws LockedByOther, or std::system_error when the file cannot be made.
  FileLock(std::filesystem::path path, const std::string& thing, const std::string& command);
  ~FileLock();
  FileLock(FileLock&& other) noexcept;
  FileLock& operator=(FileLock&&) = delete;

 private:
  std::filesystem::path path_;
  int file_ = -1;
};

}  // namespace flowscope
