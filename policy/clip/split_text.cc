#include "policy/clip/split_text.h"

#include <cstdint>
#include <stdexcept>

#include "policy/clip/characters.h"

namespace flowscope {
namespace {

std::u32string decode(std::string_view text) {
  std::u32string out;
  for (std::size_t i = 0; i < text.size();) {
    const auto byte = [&](std::size_t at) { return static_cast<std::uint8_t>(text[at]); };
    const std::uint8_t head = byte(i);
    const int extra = head < 0x80 ? 0 : head >> 5 == 6 ? 1 : head >> 4 == 14 ? 2 : head >> 3 == 30 ? 3 : -1;
    bool whole = extra >= 0 && i + extra < text.size();
    char32_t c = extra <= 0 ? head : head & (0x3F >> extra);
    for (int k = 1; whole && k <= extra; ++k) {
      whole = byte(i + k) >> 6 == 2;
      c = c << 6 | (byte(i + k) & 0x3F);
    }
    constexpr char32_t least[] = {0, 0x80, 0x800, 0x10000};
    if (!whole || c < least[extra] || c > 0x10FFFF || (c >= 0xD800 && c <= 0xDFFF))
      throw std::invalid_argument("text is not UTF-8 at byte " + std::to_string(i));
    out += c;
    i += extra + 1;
  }
  return out;
}

std::size_t literal_length(std::u32string_view rest, std::string_view literal) {
  if (rest.size() < literal.size()) return 0;
  for (std::size_t i = 0; i < literal.size(); ++i)
    if (rest[i] != static_cast<char32_t>(literal[i])) return 0;
  return literal.size();
}

template <typename Class>
std::size_t run_length(std::u32string_view rest, Class belongs) {
  std::size_t n = 0;
  while (n < rest.size() && belongs(rest[n])) ++n;
  return n;
}

// The first rule that fits decides, not the longest: "'s" before a run of marks.
std::size_t piece_length(std::u32string_view rest) {
  for (const char* literal : {start_of_text, end_of_text, "'s", "'t", "'re", "'ve", "'m", "'ll", "'d"})
    if (const std::size_t n = literal_length(rest, literal)) return n;
  if (const std::size_t n = run_length(rest, is_letter)) return n;
  if (is_number(rest.front())) return 1;
  return run_length(rest, [](char32_t c) { return !is_space(c) && !is_letter(c) && !is_number(c); });
}

}  // namespace

std::string utf8_of(char32_t c) {
  if (c < 0x80) return {static_cast<char>(c)};
  const auto tail = [&](int shift) { return static_cast<char>(0x80 | (c >> shift & 0x3F)); };
  if (c < 0x800) return {static_cast<char>(0xC0 | c >> 6), tail(0)};
  if (c < 0x10000) return {static_cast<char>(0xE0 | c >> 12), tail(6), tail(0)};
  return {static_cast<char>(0xF0 | c >> 18), tail(12), tail(6), tail(0)};
}

std::vector<std::string> split_text(std::string_view text) {
  std::u32string all = decode(text);
  for (char32_t& c : all) c = to_lower(c);
  std::vector<std::string> pieces;
  for (std::u32string_view rest = all; !rest.empty();) {
    if (is_space(rest.front())) {
      rest.remove_prefix(1);
      continue;
    }
    const std::size_t n = piece_length(rest);
    std::string piece;
    for (const char32_t c : rest.substr(0, n)) piece += utf8_of(c);
    pieces.push_back(std::move(piece));
    rest.remove_prefix(n);
  }
  return pieces;
}

}  // namespace flowscope
