#include "render/new_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <random>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>

namespace flowscope {

namespace {

constexpr std::string_view temporary_prefix = ".flowscope-tmp-";

[[noreturn]] void fail_to_write(int error, const std::filesystem::path& path) {
  throw std::system_error(error, std::generic_category(), "cannot write " + path.string());
}

std::filesystem::path folder_of(const std::filesystem::path& path) {
  return path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
}

/// A device or a folder of that name must not be replaced by a file.
std::filesystem::path checked_target(std::filesystem::path target) {
  if (!target.has_filename()) throw std::invalid_argument("not a file name: '" + target.string() + "'");
  struct stat there {};
  if (::stat(target.c_str(), &there) != 0 || S_ISREG(there.st_mode)) return target;
  if (S_ISDIR(there.st_mode)) fail_to_write(EISDIR, target);
  throw std::runtime_error("cannot write " + target.string() + ": there is something that is no file");
}

/// 0, or why not all of it was written.
int write_all(int file, std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::write(file, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return errno;
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
  return 0;
}

/// Without this the new name may be lost with the power.
void sync_folder_of(const std::filesystem::path& path) {
  const int folder = ::open(folder_of(path).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder < 0) fail_to_write(errno, path);
  const int error = ::fsync(folder) == 0 ? 0 : errno;
  ::close(folder);
  // A file system that cannot sync folders says EINVAL; it orders renames by itself.
  if (error != 0 && error != EINVAL) fail_to_write(error, path);
}

/// False when `to` exists.
bool rename_to_free(const std::filesystem::path& from, const std::filesystem::path& to) {
  if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return true;
  // Some file systems know no such rename; a hard link does not replace either.
  if ((errno == EINVAL || errno == ENOSYS) && ::link(from.c_str(), to.c_str()) == 0) {
    ::unlink(from.c_str());
    return true;
  }
  if (errno == EEXIST) return false;
  fail_to_write(errno, to);
}

}  // namespace

NewFolders::NewFolders(const std::filesystem::path& folder, const std::filesystem::path& whose) {
  std::error_code error;
  for (auto path = folder; path.has_relative_path() && !std::filesystem::exists(path, error) && !error;
       path = path.parent_path()) {
    if (path.has_filename()) made_.push_back(path);  // from the innermost out, as they are removed
  }
  error.clear();
  std::filesystem::create_directories(folder, error);
  if (!error && std::filesystem::is_directory(folder)) return;
  for (const auto& path : made_) ::rmdir(path.c_str());
  fail_to_write(error ? error.value() : ENOTDIR, whose);
}

NewFolders::~NewFolders() {
  for (const auto& path : made_) ::rmdir(path.c_str());  // stays when something lies in it
}

NewFile::NewFile(std::filesystem::path target)
    : target_(checked_target(std::move(target))), folders_(folder_of(target_), target_) {
  do {
    temporary_ = temporary_name(folder_of(target_));
    file_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  } while (file_ < 0 && errno == EEXIST);
  if (file_ < 0) fail_to_write(errno, target_);
}

NewFile::~NewFile() { discard(); }

void NewFile::write(std::span<const std::uint8_t> bytes) {
  if (const int error = write_all(file_, bytes)) fail_to_write(error, target_);
}

void NewFile::fail(std::string why) const {
  const std::vector<std::uint8_t> block(1 << 20);
  ::lseek(file_, 0, SEEK_END);
  if (const int error = write_all(file_, block)) fail_to_write(error, target_);
  const std::string name = temporary_.string();  // means nothing to the user
  for (auto at = why.find(name); at != std::string::npos; at = why.find(name)) {
    why.replace(at, name.size(), target_.filename().string());
  }
  throw std::runtime_error("cannot write " + target_.string() + ": " + why);
}

void NewFile::check(const FileCheck& check) const {
  try {
    check(temporary_);
  } catch (const std::runtime_error& error) {
    fail(error.what());
  }
}

void NewFile::sync() {
  if (::fsync(file_) != 0) fail_to_write(errno, target_);
  const int error = ::close(std::exchange(file_, -1)) == 0 ? 0 : errno;
  if (error != 0) fail_to_write(error, target_);
}

void NewFile::commit() {
  sync();
  if (::rename(temporary_.c_str(), target_.c_str()) != 0) fail_to_write(errno, target_);
  temporary_.clear();
  folders_.keep();
  sync_folder_of(target_);
}

bool NewFile::commit_new() {
  sync();
  if (!rename_to_free(temporary_, target_)) return false;
  temporary_.clear();
  folders_.keep();
  sync_folder_of(target_);
  return true;
}

void NewFile::discard() noexcept {
  if (file_ >= 0) {
    // A library that failed may hold the file open for long: its space is free from now on.
    if (::ftruncate(file_, 0) != 0) errno = 0;
    ::close(std::exchange(file_, -1));
  }
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
  temporary_.clear();
}

bool move_to_new_name(const std::filesystem::path& from, const std::filesystem::path& to) {
  if (!rename_to_free(from, to)) return false;
  sync_folder_of(to);
  sync_folder_of(from);
  return true;
}

std::filesystem::path temporary_name(const std::filesystem::path& folder) {
  std::random_device random;
  return folder /
         (std::string(temporary_prefix) + std::to_string(::getpid()) + "-" + std::to_string(random()));
}

void remove_stale_temporaries(const std::filesystem::path& folder, std::chrono::seconds age) noexcept {
  try {
    const auto oldest = std::filesystem::file_time_type::clock::now() - age;
    for (const auto& entry : std::filesystem::directory_iterator(folder.empty() ? "." : folder)) {
      std::error_code ignored;
      if (entry.path().filename().string().starts_with(temporary_prefix) &&
          entry.last_write_time(ignored) <= oldest) {
        std::filesystem::remove_all(entry.path(), ignored);
      }
    }
  } catch (const std::exception&) {
    return;  // a folder that cannot be read is reported by whoever needs its content
  }
}

bool is_full_disk(const std::exception& error) noexcept {
  const auto* system = dynamic_cast<const std::system_error*>(&error);
  if (system == nullptr) return false;
  const std::error_code& code = system->code();
  if (code.category() != std::generic_category() && code.category() != std::system_category()) return false;
  return code.value() == ENOSPC || code.value() == EDQUOT || code.value() == EFBIG;
}

}  // namespace flowscope
