#include "recorder/script_bounds.h"

#include <vector>

namespace flowscope {

namespace {

constexpr std::size_t most_brackets = 16, longest_word = 1024;
constexpr std::size_t most_items =
    60'000;  ///< commas, colons and opened brackets: what a full script of the size limit has

class Scan {
 public:
  Scan(std::string_view text, std::size_t most_steps) : text_(text), most_steps_(most_steps) {}

  std::optional<BoundBroken> run() {
    for (; at_ < text_.size() && !broken_; ++at_) {
      const char c = text_[at_];
      if (c == '\n') {
        end_line();
      } else if (quote_ != 0) {
        in_quotes(c);
      } else if (!comment_) {
        outside(c);
      }
    }
    return broken_;
  }

 private:
  void end_line() {
    line_begin_ = at_ + 1;
    ++line_;
    comment_ = false;
    line_is_blank_ = true;
    if (quote_ == 0) word_ = 0;
  }

  void in_quotes(char c) {
    if (c == '\\' && quote_ == '"' && at_ + 1 < text_.size() && text_[at_ + 1] != '\n') ++at_;
    if (c == quote_) quote_ = 0;
    grow();
  }

  void outside(char c) {
    const char before = at_ > line_begin_ ? text_[at_ - 1] : ' ';
    const bool begins = before == ' ' || before == '[' || before == '{' || before == ',' || before == ':';
    if (c == '-' && line_is_blank_ && ++dashes_ > most_steps_) too_many_steps();
    if (c != ' ') line_is_blank_ = false;
    if (c == '#' && before == ' ') {
      comment_ = true;
    } else if ((c == '"' || c == '\'') && begins) {
      quote_ = c;
      word_ = 0;
    } else if (c == '[' || c == '{') {
      commas_.push_back(0);
      if (commas_.size() > most_brackets) fail("nested too deeply");
      count_item();
    } else if (c == ']' || c == '}') {
      if (!commas_.empty()) commas_.pop_back();
      word_ = 0;
    } else if (c == ',' || c == ':') {
      if (c == ',' && !commas_.empty() && ++commas_.back() >= most_steps_) too_many_steps();
      count_item();
    } else if (!line_is_blank_) {
      grow();
    }
  }

  void count_item() {
    word_ = 0;
    if (++items_ > most_items) fail("more than " + std::to_string(most_items) + " keys and values");
  }

  void too_many_steps() { fail("more than " + std::to_string(most_steps_) + " steps"); }

  void grow() {
    if (++word_ > longest_word)
      fail("a word or text of more than " + std::to_string(longest_word) + " characters");
  }

  void fail(std::string message) {
    if (!broken_) broken_ = BoundBroken{line_, static_cast<int>(at_ - line_begin_), std::move(message)};
  }

  std::string_view text_;
  std::size_t most_steps_, at_ = 0, line_begin_ = 0, word_ = 0, dashes_ = 0, items_ = 0;
  int line_ = 0;
  std::vector<std::size_t> commas_;  ///< of each open bracket
  char quote_ = 0;
  bool comment_ = false, line_is_blank_ = true;
  std::optional<BoundBroken> broken_;
};

}  // namespace

std::optional<BoundBroken> broken_bound(std::string_view text, std::size_t most_steps) {
  return Scan(text, most_steps).run();
}

}  // namespace flowscope
