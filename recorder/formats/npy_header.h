// The head of a .npy file: what type and shape its bytes have.
#pragma once

#include <string>

#include "recorder/formats/named_array.h"

namespace flowscope {

/// Format version 1.0. `data_bytes` is needed for a text, whose length is part of its type.
std::string npy_header(const ArraySpec& spec, std::uint64_t data_bytes);

}  // namespace flowscope
