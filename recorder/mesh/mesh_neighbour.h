// Files that a mesh file names: only those beside it and below are opened.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace flowscope {

/// Whether a path, its links followed, ends in a folder or below it.
bool lies_below(const std::filesystem::path& folder, const std::filesystem::path& file);
/// The file that a mesh file in `folder` means by a name: with %20 and the like, and with the paths of its
/// author's machine, whose bare names will do. Throws std::runtime_error saying what is wrong with it.
std::filesystem::path neighbour(const std::filesystem::path& folder, const std::string& name);
/// Throws std::runtime_error for a file of more than so many MiB or one that can not be read.
std::vector<std::uint8_t> bytes_of(const std::filesystem::path& file, std::uintmax_t most_mib);

}  // namespace flowscope
