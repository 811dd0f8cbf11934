// SHA-256 as lower-case hex, for file trailers and state fingerprints.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace flowscope {
std::string sha256_hex(std::span<const std::uint8_t> bytes);
}
