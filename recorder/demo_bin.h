// Where removed demonstrations lie until they are restored or the bin is emptied.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "recorder/demo.h"

namespace flowscope {

struct BinEntry {
  std::string name;     ///< "<id>.<n>": the n-th file that came here under that id
  DemoInfo info;        ///< only id and bytes when the file is not a whole demonstration
  std::string removed;  ///< ISO 8601, UTC
};

/// The folder `bin` beside `demos`. What comes here is whole or was not whole before. Any thread.
class DemoBin {
 public:
  /// Made by the first file that comes.
  explicit DemoBin(std::filesystem::path folder) : folder_(std::move(folder)) {}

  /// Moves a demonstration's file here. Throws std::system_error.
  void put(const std::filesystem::path& file) const;
  /// The same for a file that is about to be replaced and has to stay where it is until then.
  void put_copy(const std::filesystem::path& file) const;
  /// The newest file of an id, or the one of a BinEntry::name; none when there is no such.
  std::optional<std::filesystem::path> find(const std::string& id_or_name) const;
  /// In the order in which they came.
  std::vector<BinEntry> list() const;
  /// Removes all that list() names, for good.
  void empty() const;

 private:
  std::filesystem::path folder_;
};

}  // namespace flowscope
