// What an MP4 file consists of, as far as it takes to know that it is whole.
#pragma once

#include <filesystem>

namespace flowscope {

/// Throws std::runtime_error that names the file unless its outermost boxes fill it to the last byte and the
/// index (moov) comes before the frames (mdat). An encoder's good exit code does not say that.
void require_whole_mp4(const std::filesystem::path& file);

}  // namespace flowscope
