#include "recorder/new_folder.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <system_error>
#include <utility>

namespace flowscope {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail_to_write(int error, const fs::path& path) {
  throw std::system_error(error, std::generic_category(), "cannot write " + path.string());
}

/// 0, or why it could not be written.
int write_file(const fs::path& path, std::span<const std::uint8_t> bytes) {
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (file < 0) return errno;
  int error = 0;
  while (!bytes.empty() && error == 0) {
    const ssize_t count = ::write(file, bytes.data(), bytes.size());
    if (count >= 0) bytes = bytes.subspan(static_cast<std::size_t>(count));
    if (count < 0 && errno != EINTR) error = errno;
  }
  if (::close(file) != 0 && error == 0) error = errno;
  return error;
}

}  // namespace

NewFolder::NewFolder(const fs::path& parent, fs::path named)
    : parent_(parent), named_(std::move(named)), above_(parent_, named_), path_(temporary_name(parent_)) {
  std::error_code error;
  fs::create_directory(path_, error);
  if (error) fail_to_write(error.value(), named_);
}

NewFolder::~NewFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

void NewFolder::write(const fs::path& file, std::span<const std::uint8_t> bytes) const {
  std::error_code error;
  if (file.has_parent_path()) fs::create_directories(path_ / file.parent_path(), error);
  const int problem = error ? error.value() : write_file(path_ / file, bytes);
  if (problem != 0) fail_to_write(problem, named_ / file);
}

void NewFolder::sync() const {
  const int folder = ::open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  const int error = folder >= 0 && ::syncfs(folder) == 0 ? 0 : errno;
  if (folder >= 0) ::close(folder);
  if (error != 0) fail_to_write(error, named_);
}

bool NewFolder::become(const fs::path& target) {
  if (::renameat2(AT_FDCWD, path_.c_str(), AT_FDCWD, target.c_str(), RENAME_NOREPLACE) != 0) {
    if (errno == EEXIST || errno == ENOTEMPTY) return false;
    fail_to_write(errno, target);
  }
  above_.keep();
  return true;
}

void NewFolder::move_into_parent(const std::vector<std::string>& files) {
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (::rename((path_ / files[i]).c_str(), (parent_ / files[i]).c_str()) == 0) continue;
    const int error = errno;
    for (std::size_t moved = 0; moved < i; ++moved) ::unlink((parent_ / files[moved]).c_str());
    fail_to_write(error, parent_ / files[i]);
  }
  above_.keep();
}

}  // namespace flowscope
