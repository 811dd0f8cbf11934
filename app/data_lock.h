// Which commands exclude each other: see DEVELOPING, "Nothing is lost".
#pragma once

#include <filesystem>
#include <string>

#include "recorder/file_lock.h"

namespace flowscope::app {

/// Held by whoever adds, changes or removes demonstrations of `data`, which is made when missing. `command`
/// as it was called ("record close_jar"), without secrets. What a killed program left half written goes.
/// Commands that only read need none: files appear whole and never change under a reader.
[[nodiscard]] FileLock lock_data(const std::filesystem::path& data, const std::string& command);

/// Held by whoever trains into `policy`; its folder is made when missing.
[[nodiscard]] FileLock lock_policy(const std::filesystem::path& policy, const std::string& command);

}  // namespace flowscope::app
