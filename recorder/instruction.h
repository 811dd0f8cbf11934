// What a policy can read of an instruction: its words.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace flowscope {

/// Lower-case words without punctuation. Letters beyond ASCII belong to words as they are (UTF-8).
std::vector<std::string> split_words(std::string_view instruction);

/// A demonstration whose instruction holds no word can teach nothing.
inline bool has_word(std::string_view instruction) { return !split_words(instruction).empty(); }

}  // namespace flowscope
