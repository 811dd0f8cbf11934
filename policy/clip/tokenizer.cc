#include "policy/clip/tokenizer.h"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "policy/clip/split_text.h"

namespace flowscope {
namespace {

constexpr const char* end_of_piece = "</w>";

// Bytes that print stand for themselves; the others, which a text file of merges could not show, take the
// next characters from 256 on. The order is that of the published vocabulary: first what prints.
struct ByteSymbols {
  std::vector<std::string> symbol = std::vector<std::string>(256);
  std::vector<int> order;
};

ByteSymbols byte_symbols() {
  const auto prints = [](int b) {
    return (b >= '!' && b <= '~') || (b >= 0xA1 && b <= 0xAC) || (b >= 0xAE && b <= 0xFF);
  };
  ByteSymbols out;
  char32_t next = 256;
  for (const bool printing : {true, false}) {
    for (int b = 0; b < 256; ++b) {
      if (prints(b) != printing) continue;
      out.symbol[b] = utf8_of(printing ? static_cast<char32_t>(b) : next++);
      out.order.push_back(b);
    }
  }
  return out;
}

}  // namespace

ClipTokenizer::ClipTokenizer(std::string_view merges) {
  ByteSymbols bytes = byte_symbols();
  int id = 0;
  for (const char* ending : {"", end_of_piece})
    for (const int b : bytes.order) id_[bytes.symbol[b] + ending] = id++;
  byte_symbol_ = std::move(bytes.symbol);
  int rank = 0, line_number = 0;
  while (!merges.empty()) {
    const std::size_t length = std::min(merges.find('\n'), merges.size());
    std::string line(merges.substr(0, length));
    merges.remove_prefix(std::min(length + 1, merges.size()));
    ++line_number;
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line_number == 1 && line.find("#version") != std::string::npos) continue;
    if (line.empty() && merges.find_first_not_of("\r\n") == std::string_view::npos) break;
    const std::size_t blank = line.find(' ');
    if (blank == std::string::npos || blank == 0 || blank + 1 == line.size() || blank != line.rfind(' '))
      throw std::invalid_argument("merges: line " + std::to_string(line_number) +
                                  " is not a pair of symbols");
    // Of two equal pairs the later one counts, as in the published tokenizer.
    rank_[line] = rank++;
    id_[line.substr(0, blank) + line.substr(blank + 1)] = id++;
  }
  start_ = id;
}

std::vector<int> ClipTokenizer::merge_bytes(std::string_view piece) const {
  std::vector<std::string> symbols;
  for (const char c : piece) symbols.push_back(byte_symbol_[static_cast<unsigned char>(c)]);
  symbols.back() += end_of_piece;
  while (symbols.size() > 1) {
    int best = std::numeric_limits<int>::max();
    std::string left, right;
    for (std::size_t i = 0; i + 1 < symbols.size(); ++i) {
      const auto found = rank_.find(symbols[i] + ' ' + symbols[i + 1]);
      if (found == rank_.end() || found->second >= best) continue;
      best = found->second;
      left = symbols[i];
      right = symbols[i + 1];
    }
    if (best == std::numeric_limits<int>::max()) break;
    std::vector<std::string> merged;
    for (std::size_t i = 0; i < symbols.size(); ++i) {
      const bool here = i + 1 < symbols.size() && symbols[i] == left && symbols[i + 1] == right;
      merged.push_back(here ? left + right : symbols[i]);
      if (here) ++i;
    }
    symbols = std::move(merged);
  }
  std::vector<int> ids;
  for (const std::string& symbol : symbols) ids.push_back(id_.at(symbol));
  return ids;
}

std::vector<ClipToken> ClipTokenizer::encode(std::string_view text, int limit) const {
  if (limit < 2) throw std::invalid_argument("tokenizer: the limit must leave room for start and end");
  std::vector<ClipToken> tokens{{start(), ""}};
  for (const std::string& piece : split_text(text)) {
    if (piece == start_of_text || piece == end_of_text) {
      tokens.push_back({piece == start_of_text ? start() : end(), ""});
      continue;
    }
    for (const int id : merge_bytes(piece)) tokens.push_back({id, piece});
  }
  tokens.resize(std::min<std::size_t>(tokens.size(), static_cast<std::size_t>(limit) - 1));
  tokens.push_back({end(), ""});
  return tokens;
}

}  // namespace flowscope
