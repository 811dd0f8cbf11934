// The built page, kept in memory and read again when a file changes.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "web/http.h"

namespace flowscope::web {

/// One thread. Only plain names below the folder are served; links that lead out of it are not.
class StaticFiles {
 public:
  explicit StaticFiles(const std::filesystem::path& folder);
  /// `path` is the decoded path of the address; "/" is index.html. Empty when there is no such file.
  std::optional<Response> get(const std::string& path);

 private:
  struct Entry {
    std::filesystem::file_time_type changed;
    std::string body;
  };
  std::filesystem::path folder_;
  std::map<std::filesystem::path, Entry> files_;
};

}  // namespace flowscope::web
