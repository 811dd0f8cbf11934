// Whole files in one call: bytes in memory onto the disk.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

#include "render/new_file.h"

namespace flowscope {

/// Over what was there. On any failure what was under `path` stays, nothing else is left, and
/// std::system_error names the path and the cause (disk full, …).
void write_file_atomically(const std::filesystem::path& path, std::span<const std::uint8_t> bytes);

/// The same, but never over an existing file: false when `path` was taken, even by another program at the
/// same moment.
[[nodiscard]] bool write_new_file_atomically(const std::filesystem::path& path,
                                             std::span<const std::uint8_t> bytes);

}  // namespace flowscope
