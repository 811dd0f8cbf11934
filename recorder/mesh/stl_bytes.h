// STL files as their writers leave them, made fit for a strict reader.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace flowscope {

/// What belongs to the triangles of a binary or a text file: bytes after its end go (and are told), SOLID in
/// capitals is as good as solid.
std::vector<std::uint8_t> sound_stl(std::vector<std::uint8_t> bytes,
                                    const std::function<void(const std::string&)>& tell);

}  // namespace flowscope
