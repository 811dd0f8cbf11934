// Demonstrations on disk: one immutable, checksummed file each. Links neither MuJoCo nor torch.
#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <vector>

#include "recorder/demo.h"
#include "recorder/demo_bin.h"

namespace flowscope {

/// A file that is not a whole demonstration; what() names the file and the place.
class BadDemo : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A demonstration that check() would call bad, and that is therefore not taken in; what() says why.
class RefusedDemo : public std::runtime_error {
 public:
  explicit RefusedDemo(const std::string& problem, std::string id_of_twin = "")
      : std::runtime_error(problem), twin(std::move(id_of_twin)) {}
  std::string twin;  ///< the one that holds the same states already; empty: this one itself is wrong
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
  /// returns the id. Throws RefusedDemo for what check() would call bad, std::invalid_argument for what the
  /// file cannot hold, std::runtime_error (disk full, no permission), and leaves nothing half-written under a
  /// final name.
  std::string save(const Demo& demo) const;
  /// Headers only, ordered by creation. Files whose header cannot be read are left out, and told in
  /// `unreadable`.
  std::vector<DemoInfo> list(std::vector<DemoProblem>* unreadable = nullptr) const;
  /// Throws BadDemo, or std::out_of_range for an unknown id.
  Demo load(const std::string& id) const;
  /// Without frames' states and only what training needs: much smaller in memory.
  Demo load_keyframes(const std::string& id) const;
  /// Moves it into the bin. Throws std::out_of_range for an unknown id.
  void remove(const std::string& id) const;
  /// Brings back from the bin what was removed last under `id` (or one BinEntry::name) and returns the id.
  /// What the store has under that id meanwhile takes its place in the bin. Throws std::out_of_range.
  std::string restore(const std::string& id_or_name) const;
  /// Puts `demo` in the place of `id`, whose file goes into the bin. Like save() in all else.
  void replace(const std::string& id, const Demo& demo) const;
  /// Takes in a whole file of another store, byte for byte, under `wanted_id` or, when that is taken, under
  /// one with a free number; returns the id. Throws BadDemo when the bytes are not a demonstration,
  /// RefusedDemo for what check() would call bad.
  std::string adopt(const std::vector<std::uint8_t>& bytes, const std::string& wanted_id) const;
  DemoBin bin() const { return DemoBin(dir_.parent_path() / "bin"); }
  /// Verifies every checksum and what DemoJudge finds (demo_check.h): the rule by which save(), replace() and
  /// adopt() take demonstrations in.
  std::vector<DemoProblem> check(int* checked = nullptr) const;
  std::filesystem::path path(const std::string& id) const;
  std::filesystem::path data() const { return dir_.parent_path(); }

 private:
  /// Throws RefusedDemo unless the file of these bytes would pass check() beside the others; `instead_of`:
  /// one that it is to replace.
  void require_good(const std::vector<std::uint8_t>& bytes, const std::string& instead_of = "") const;

  std::filesystem::path dir_;
  std::shared_ptr<std::mutex> taking_in_ = std::make_shared<std::mutex>();  ///< no twins at one moment
};

}  // namespace flowscope
