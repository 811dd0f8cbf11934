// What a JSON text may cost to read, judged in one cheap pass before anybody parses it.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace flowscope::web::wire {

/// Throws ApiError 400 with line and column where the text goes beyond: 32 levels, keys of 256 bytes, 1000
/// keys, numbers and words of 64 characters, 20 000 values. Says nothing about whether it is JSON.
void check_json_bounds(std::string_view text);

/// "line 3, column 7" of a place in the text, counted from 1.
std::string line_and_column(std::string_view text, std::size_t place);

}  // namespace flowscope::web::wire
