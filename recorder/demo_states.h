// The simulator's states inside a demonstration file.
#pragma once

#include <string>
#include <vector>

#include "recorder/bytes.h"
#include "recorder/demo_header.h"

namespace flowscope {

/// Throws std::invalid_argument naming the frame whose state differs in scene or size from the first.
StateLayout describe_states(const std::vector<Frame>& frames);

/// Appends every frame's state to `blocks`, fills `layout`, returns the packed size. Throws
/// std::invalid_argument like describe_states, or naming the frame that holds a number that is not finite.
std::uint64_t pack_states(const std::vector<Frame>& frames, StateLayout& layout, Bytes& blocks);

/// Fills the states of `frames`. Throws std::exception when the block is damaged.
void unpack_states(std::span<const std::uint8_t> packed, const StateLayout& layout,
                   std::vector<Frame>& frames);

/// Fingerprint of the states alone: two demonstrations with the same one show the same motion. Throws
/// std::invalid_argument like pack_states.
std::string states_sha256(const std::vector<Frame>& frames);

}  // namespace flowscope
