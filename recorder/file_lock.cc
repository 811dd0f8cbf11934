#include "recorder/file_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <iterator>
#include <system_error>
#include <thread>
#include <utility>

#include "recorder/utc_time.h"

namespace flowscope {
namespace {

/// Who holds the lock, in its own words. The holder writes them just after it has taken the lock.
std::string holder_of(const std::filesystem::path& path) {
  for (int attempt = 0; attempt < 20; ++attempt) {
    std::ifstream stream(path);
    std::string text(std::istreambuf_iterator<char>(stream), {});
    if (!text.empty() && text.back() == '\n') {
      text.pop_back();
      return text;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return "another program";
}

/// The file that was locked may have been removed between opening and locking it, by the one who let go.
bool is_still_there(int file, const std::filesystem::path& path) {
  struct stat locked {};
  struct stat named {};
  return ::fstat(file, &locked) == 0 && ::stat(path.c_str(), &named) == 0 && locked.st_ino == named.st_ino &&
         locked.st_dev == named.st_dev;
}

/// The locked file.
int take(const std::filesystem::path& path, const std::string& thing) {
  for (;;) {
    const int file = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0644);
    if (file < 0) throw std::system_error(errno, std::generic_category(), "cannot lock " + path.string());
    if (::flock(file, LOCK_EX | LOCK_NB) != 0) {
      const int error = errno;
      ::close(file);
      if (error == EINTR) continue;
      if (error == EWOULDBLOCK) throw LockedByOther(thing + " is in use by " + holder_of(path));
      throw std::system_error(error, std::generic_category(), "cannot lock " + path.string());
    }
    if (is_still_there(file, path)) return file;
    ::close(file);
  }
}

}  // namespace

FileLock::FileLock(std::filesystem::path path, const std::string& thing, const std::string& command)
    : path_(std::move(path)), file_(take(path_, thing)) {
  const std::string who =
      command + " (process " + std::to_string(::getpid()) + ", since " + utc_now() + ")\n";
  // Only words for whoever comes second: on a full disk they are missing and the lock holds all the same.
  if (::ftruncate(file_, 0) != 0 || ::write(file_, who.data(), who.size()) < 0) return;
}

FileLock::FileLock(FileLock&& other) noexcept
    : path_(std::move(other.path_)), file_(std::exchange(other.file_, -1)) {}

FileLock::~FileLock() {
  if (file_ < 0) return;
  ::unlink(path_.c_str());  // while it is still locked: the next taker sees that it is gone
  ::close(file_);
}

}  // namespace flowscope
