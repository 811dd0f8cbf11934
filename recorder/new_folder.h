// Files that appear together or not at all.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "render/new_file.h"

namespace flowscope {

/// A folder under a temporary name: it goes with this object unless it, or what lies in it, was moved to its
/// place. Throws std::system_error naming the path that the user will see and the cause. One thread.
class NewFolder {
 public:
  /// In `parent`, which is made when it is missing; `named` stands for the folder in messages.
  NewFolder(const std::filesystem::path& parent, std::filesystem::path named);
  ~NewFolder();
  NewFolder(const NewFolder&) = delete;
  NewFolder& operator=(const NewFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  /// `file` relative to the folder; folders on the way are made.
  void write(const std::filesystem::path& file, std::span<const std::uint8_t> bytes) const;
  /// Everything in it reaches the disk with one call: there may be thousands of files.
  void sync() const;
  /// Never over what is there: false when `target` was taken, even at the same moment.
  [[nodiscard]] bool become(const std::filesystem::path& target);
  /// The files in this order, over what is there; on failure those that were moved go again.
  void move_into_parent(const std::vector<std::string>& files);

 private:
  std::filesystem::path parent_, named_;
  NewFolders above_;
  std::filesystem::path path_;
};

}  // namespace flowscope
