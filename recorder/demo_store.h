// Demonstrations on disk: one immutable, checksummed file each. Links neither MuJoCo nor torch.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "recorder/demo.h"

namespace flowscope {

/// A file that is not a whole demonstration; what() names the file and the place.
class BadDemo : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct DemoProblem {
  std::string id, problem;
};

/// A folder of demonstrations. Safe to use from several threads; every call reads the disk, so two programs
/// agree.
class DemoStore {
 public:
  /// `data_dir` is the user's --data folder; demonstrations live in its demos/. Created when missing.
  explicit DemoStore(std::filesystem::path data_dir);

  /// Writes, syncs, renames, syncs the folder: when this returns the demonstration is on disk. Assigns and
  /// returns the id. Throws std::runtime_error (disk full, no permission) and leaves nothing half-written
  /// under a final name.
  std::string save(const Demo& demo) const;
  /// Headers only, ordered by creation. Unreadable files are left out here and named by check().
  std::vector<DemoInfo> list() const;
  /// Throws BadDemo, or std::out_of_range for an unknown id.
  Demo load(const std::string& id) const;
  /// Without frames' states and only what training needs: much smaller in memory.
  Demo load_keyframes(const std::string& id) const;
  void remove(const std::string& id) const;
  /// Verifies every checksum and that the content is coherent (finite numbers, keyframes in order, no
  /// constant picture).
  std::vector<DemoProblem> check(int* checked = nullptr) const;
  std::filesystem::path path(const std::string& id) const;

 private:
  std::filesystem::path dir_;
};

}  // namespace flowscope
