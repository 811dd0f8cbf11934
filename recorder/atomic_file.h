// Files that are either whole or absent.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <span>

namespace flowscope {

/// Writes beside `path` under a temporary name, fsyncs, renames over it, fsyncs the folder. On any failure
/// the temporary is removed, what was under `path` stays, and std::system_error names the path and the cause
/// (disk full, …).
void write_file_atomically(const std::filesystem::path& path, std::span<const std::uint8_t> bytes);

/// The same, but never over an existing file: false when `path` was taken, even by another program at the
/// same moment.
[[nodiscard]] bool write_new_file_atomically(const std::filesystem::path& path,
                                             std::span<const std::uint8_t> bytes);

/// Moves a file within one file system, never over an existing one: false when `to` was taken. Syncs both
/// folders. Throws std::system_error that names both paths.
[[nodiscard]] bool move_to_new_name(const std::filesystem::path& from, const std::filesystem::path& to);

/// Removes temporaries that a killed program left in `folder` more than `age` ago. Never throws.
void remove_stale_temporaries(const std::filesystem::path& folder,
                              std::chrono::seconds age = std::chrono::hours(1)) noexcept;

}  // namespace flowscope
