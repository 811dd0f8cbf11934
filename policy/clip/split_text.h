// How CLIP's tokenizer cleans a text and cuts it into pieces. The rules are those of the expression published
// with CLIP: the two special tokens, English contractions, runs of letters, single digits, runs of other
// marks.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace flowscope {

inline constexpr const char* start_of_text = "<|startoftext|>";
inline constexpr const char* end_of_text = "<|endoftext|>";

/// UTF-8 pieces, lower-cased, without blanks. Throws std::invalid_argument naming the byte where `text` is
/// not UTF-8.
std::vector<std::string> split_text(std::string_view text);

std::string utf8_of(char32_t character);

}  // namespace flowscope
