// Pictures inside a demonstration file.
#pragma once

#include <vector>

#include "recorder/bytes.h"
#include "recorder/demo_header.h"

namespace flowscope {

/// How the observation's pictures will lie in a file, their compressed sizes still 0. Throws
/// std::invalid_argument like pack_observation.
std::vector<ViewLayout> describe_observation(const Observation& observation);

/// Appends the observation's pictures to `blocks`. Throws std::invalid_argument naming the view whose picture
/// does not have its camera's size or whose depth is negative or not finite.
std::vector<ViewLayout> pack_observation(const Observation& observation, Bytes& blocks);

/// Throws std::exception when a block is damaged.
Observation unpack_observation(ByteReader& reader, const std::vector<ViewLayout>& layouts);

}  // namespace flowscope
