// Files that are either whole or absent.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

namespace flowscope {

/// Writes beside `path` under a temporary name, fsyncs, renames over it, fsyncs the folder. On any failure the temporary
/// is removed, what was under `path` stays, and std::system_error names the path and the cause (disk full, …).
void write_file_atomically(const std::filesystem::path& path, std::span<const std::uint8_t> bytes);

}  // namespace flowscope
