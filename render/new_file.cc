#include "render/new_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>

namespace flowscope {

namespace {

[[noreturn]] void fail(const std::filesystem::path& path, const char* what) {
  throw std::system_error(errno, std::generic_category(), std::string(what) + " " + path.string());
}

class Descriptor {
 public:
  Descriptor(const std::filesystem::path& path, int flags)
      : fd_(::open(path.c_str(), flags | O_CLOEXEC, 0666)) {
    if (fd_ < 0) fail(path, "cannot open");
  }
  ~Descriptor() { ::close(fd_); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return fd_; }

 private:
  int fd_;
};

std::filesystem::path folder_of(const std::filesystem::path& path) {
  return path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
}

}  // namespace

NewFile::NewFile(std::filesystem::path target) : target_(std::move(target)) {
  static std::atomic<unsigned> counter{0};
  if (!target_.has_filename()) throw std::invalid_argument("not a file name: '" + target_.string() + "'");
  std::filesystem::create_directories(folder_of(target_));
  temporary_ = target_;
  temporary_ += "." + std::to_string(::getpid()) + "-" + std::to_string(counter++) + ".part";
}

NewFile::~NewFile() {
  std::error_code ignored;
  std::filesystem::remove(temporary_, ignored);
}

void NewFile::write(std::span<const std::uint8_t> bytes) {
  const Descriptor file(temporary_, O_WRONLY | O_CREAT | O_TRUNC);
  while (!bytes.empty()) {
    const ssize_t count = ::write(file.get(), bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail(target_, "cannot write");
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
}

void NewFile::commit() {
  {
    const Descriptor file(temporary_, O_RDONLY);
    if (::fsync(file.get()) != 0) fail(target_, "cannot sync");
  }
  if (::rename(temporary_.c_str(), target_.c_str()) != 0) fail(target_, "cannot create");
  const Descriptor folder(folder_of(target_), O_RDONLY | O_DIRECTORY);
  if (::fsync(folder.get()) != 0) fail(target_, "cannot sync the folder of");
}

}  // namespace flowscope
