// Which contents a data folder has already, whatever their ids.
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "recorder/bytes.h"
#include "recorder/demo_store.h"

namespace flowscope::app {

/// Every demonstration file of a data folder, unreadable ones too, in order of name.
std::vector<std::filesystem::path> demo_files_of(const std::filesystem::path& data);

class DemoContents {
 public:
  /// Reads every file that can be read.
  explicit DemoContents(const DemoStore& store);
  /// Whether there is a file of these bytes.
  bool has(const Bytes& file) const;
  void add(const Bytes& file);

 private:
  std::set<std::string> sha256_;
};

}  // namespace flowscope::app
