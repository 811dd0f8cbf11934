// A file that is whole or absent: written beside its target under a temporary name, checked, synced, then
// moved. Every file of this house comes into being this way.
#pragma once

#include <chrono>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace flowscope {

/// Gets a finished file before it appears under its name; throws std::runtime_error unless it is what it
/// should be.
using FileCheck = std::function<void(const std::filesystem::path&)>;

/// Makes a folder and those above it. Without keep() the ones that it made go again, if nothing lies in them.
class NewFolders {
 public:
  /// Throws std::system_error that names `whose`, the file that the folder is for.
  NewFolders(const std::filesystem::path& folder, const std::filesystem::path& whose);
  ~NewFolders();
  NewFolders(const NewFolders&) = delete;
  NewFolders& operator=(const NewFolders&) = delete;
  void keep() { made_.clear(); }

 private:
  std::vector<std::filesystem::path> made_;
};

/// Until commit() only `temporary()` exists, and it goes with this object, as do folders made for it. What is
/// thrown about the disk is std::system_error and names the target and the cause. One thread.
class NewFile {
 public:
  /// Makes missing folders and an empty temporary. Refuses what stands there and is no file.
  explicit NewFile(std::filesystem::path target);
  ~NewFile();
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;

  const std::filesystem::path& target() const { return target_; }
  /// For libraries that write by name: same folder, a name of its own, no usual extension.
  const std::filesystem::path& temporary() const { return temporary_; }
  /// Behind what was written before.
  void write(std::span<const std::uint8_t> bytes);
  /// For whoever let a library write: throws the disk's own complaint where it has one (libraries seldom say
  /// that it is full), else std::runtime_error with `why`.
  [[noreturn]] void fail(std::string why) const;
  /// What `check` throws about the temporary becomes a fail().
  void check(const FileCheck& check) const;
  /// Over what was there.
  void commit();
  /// Never over an existing file: false when the target was taken, even at the same moment.
  [[nodiscard]] bool commit_new();

 private:
  void sync();
  void discard() noexcept;

  std::filesystem::path target_, temporary_;
  NewFolders folders_;
  int file_ = -1;
};

/// Moves a file within one file system, never over an existing one: false when `to` was taken. Syncs both
/// folders. Throws std::system_error that names the path.
[[nodiscard]] bool move_to_new_name(const std::filesystem::path& from, const std::filesystem::path& to);

/// A name for something temporary in `folder` that nobody else has: remove_stale_temporaries knows it.
std::filesystem::path temporary_name(const std::filesystem::path& folder);

/// Removes temporaries that a killed program left in `folder` more than `age` ago. Never throws.
void remove_stale_temporaries(const std::filesystem::path& folder,
                              std::chrono::seconds age = std::chrono::hours(1)) noexcept;

/// Whether an error says that something did not fit: a full disk or quota, a file above the size allowed.
bool is_full_disk(const std::exception& error) noexcept;

}  // namespace flowscope
