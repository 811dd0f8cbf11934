// The demonstration file: "FLOWDEMO", u32 version, u32 length, JSON header, blocks, SHA-256 of everything
// before it. Blocks in order: frames (24 doubles each), keyframe actions (8 doubles each), states (zlib of
// each state XOR the one before), then for each observation and view RGB (zlib) and depth (zlib of 16-bit
// counts, each less its left neighbour).
#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "recorder/bytes.h"
#include "recorder/demo_header.h"
#include "recorder/demo_store.h"

namespace flowscope {

enum class DemoParts { all, without_states };

/// Exact but for depth, which is rounded to 0.1 mm (coarser only in a view that sees beyond 6.5 m).
/// Throws std::invalid_argument naming the place when `demo` holds what the format cannot: non-finite
/// numbers, states of different sizes, pictures that do not have their camera's size, a negative variation.
Bytes encode_demo(const Demo& demo);

/// The header that encode_demo writes, with all sizes of compressed blocks 0. Throws like encode_demo.
DemoHeader describe_demo(const Demo& demo);

/// Checks the checksum first, then everything else. Throws BadDemo naming `file` and the place. The id is
/// `file`'s stem.
Demo decode_demo(std::span<const std::uint8_t> bytes, const std::filesystem::path& file, DemoParts parts);

/// Reads the header alone: no checksum. Throws BadDemo.
DemoInfo read_demo_info(const std::filesystem::path& file);

/// A frame's numbers as they lie in the file, its state apart.
Bytes frame_bytes(const Frame& frame);

/// The same of frame `index` in a file, without a look at anything else; empty where there is none.
Bytes read_frame_bytes(const std::filesystem::path& file, std::size_t index);

/// The whole file. Throws BadDemo naming the file when it cannot be read or is larger than any demonstration.
Bytes read_demo_bytes(const std::filesystem::path& file);

}  // namespace flowscope
