#include "web/json_bounds.h"

#include <algorithm>
#include <string>

#include "web/backend.h"

namespace flowscope::web::wire {

namespace {

constexpr int deepest = 32;
constexpr std::size_t longest_key = 256, longest_word = 64, most_keys = 1000, most_values = 20'000;

class BoundsScan {
 public:
  explicit BoundsScan(std::string_view text) : text_(text) {}

  void run() {
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (c == '"') {
        skip_text();
      } else if (c == '[' || c == '{') {
        if (++depth_ > deepest) fail("too_deep", "nested deeper than " + std::to_string(deepest) + " levels");
        count_value();
        ++at_;
      } else if (c == ']' || c == '}') {
        --depth_;
        ++at_;
      } else if (c == ':') {
        end_key();
      } else if (c == ',') {
        count_value();
        ++at_;
      } else if (is_blank(c)) {
        ++at_;
      } else {
        skip_word();
      }
    }
  }

 private:
  static bool is_blank(char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; }

  /// A value may be long, a key is judged at its colon.
  void skip_text() {
    text_begin_ = at_++;
    while (at_ < text_.size() && text_[at_] != '"') at_ += text_[at_] == '\\' ? 2 : 1;
    if (at_ >= text_.size()) {
      at_ = text_begin_;
      fail("bad_json", "not JSON: a text without its closing quote");
    }
    text_size_ = ++at_ - text_begin_;
  }

  void skip_word() {
    const std::size_t begin = at_;
    constexpr std::string_view ends = "\"[]{}:, \n\r\t";
    while (at_ < text_.size() && ends.find(text_[at_]) == ends.npos)
      if (++at_ - begin > longest_word)
        fail("too_long", "a number or word of more than " + std::to_string(longest_word) + " characters");
  }

  void end_key() {
    ++at_;
    if (text_size_ > longest_key + 2) {
      at_ = text_begin_;
      fail("key_too_long", "a key of more than " + std::to_string(longest_key) + " bytes");
    }
    if (++keys_ > most_keys) fail("too_many_keys", "more than " + std::to_string(most_keys) + " keys");
  }

  void count_value() {
    if (++values_ > most_values)
      fail("too_many_values", "more than " + std::to_string(most_values) + " values");
  }

  [[noreturn]] void fail(const char* code, const std::string& message) const {
    throw ApiError(400, code, message, line_and_column(text_, at_));
  }

  std::string_view text_;
  std::size_t at_ = 0, text_begin_ = 0, text_size_ = 0, keys_ = 0, values_ = 0;
  int depth_ = 0;
};

}  // namespace

void check_json_bounds(std::string_view text) { BoundsScan(text).run(); }

std::string line_and_column(std::string_view text, std::size_t place) {
  const std::string_view before = text.substr(0, std::min(place, text.size()));
  const std::size_t line_begin = before.rfind('\n') + 1;  // npos + 1 is 0
  return "line " + std::to_string(std::count(before.begin(), before.end(), '\n') + 1) + ", column " +
         std::to_string(before.size() - line_begin + 1);
}

}  // namespace flowscope::web::wire
