#include "recorder/instruction.h"

#include <cctype>
#include <utility>

namespace flowscope {
namespace {

/// Bytes of one UTF-8 character that begins with `lead`.
std::size_t length_of(unsigned char lead) {
  if (lead < 0xC0) return 1;
  return lead < 0xE0 ? 2 : lead < 0xF0 ? 3 : 4;
}

/// Quotes, dashes, dots and spaces beyond ASCII: U+0080 … U+00BF, U+2000 … U+206F, U+3000 … U+303F.
bool is_punctuation(std::string_view character) {
  const auto byte = [&](std::size_t i) {
    return i < character.size() ? static_cast<unsigned char>(character[i]) : 0;
  };
  if (byte(0) == 0xC2) return true;
  if (byte(0) == 0xE2) return byte(1) == 0x80 || (byte(1) == 0x81 && byte(2) < 0xB0);
  return byte(0) == 0xE3 && byte(1) == 0x80;
}

}  // namespace

std::vector<std::string> split_words(std::string_view instruction) {
  std::vector<std::string> words;
  std::string word;
  for (std::size_t at = 0; at < instruction.size();) {
    const auto lead = static_cast<unsigned char>(instruction[at]);
    const std::string_view character = instruction.substr(at, length_of(lead));
    at += character.size();
    if (lead < 0x80 && std::isalnum(lead)) {
      word += static_cast<char>(std::tolower(lead));
    } else if (lead >= 0xC0 && !is_punctuation(character)) {
      word += character;
    } else if (!word.empty()) {
      words.push_back(std::exchange(word, {}));
    }
  }
  if (!word.empty()) words.push_back(word);
  return words;
}

}  // namespace flowscope
