#include "policy/words.h"

#include <algorithm>
#include <stdexcept>

#include "recorder/colors.h"

namespace flowscope {

std::optional<Eigen::Vector3f> color_of_word(std::string_view word) {
  for (const NamedColor& c : benchmark_colors)
    if (c.name == word) return Eigen::Vector3f(c.rgb[0], c.rgb[1], c.rgb[2]);
  return std::nullopt;
}

void Vocabulary::learn(std::string_view instruction) {
  if (encoder_) return;
  for (const std::string& word : split_words(instruction)) {
    if (color_of_word(word) || static_cast<int>(known_.size()) + first >= capacity_) continue;
    if (std::find(known_.begin(), known_.end(), word) == known_.end()) known_.push_back(word);
  }
}

std::vector<Word> Vocabulary::encode(std::string_view instruction, int limit) const {
  if (encoder_) return encoder_->encode(std::string(instruction), limit);
  std::vector<Word> out;
  int mentions = 0;
  for (const std::string& text : split_words(instruction)) {
    if (static_cast<int>(out.size()) == limit) break;
    Word word;
    if (const auto rgb = color_of_word(text)) {
      word = {color, ++mentions, *rgb, nullptr};
    } else {
      const auto it = std::find(known_.begin(), known_.end(), text);
      word.row = it == known_.end() ? unknown : first + static_cast<int>(it - known_.begin());
    }
    out.push_back(word);
  }
  if (out.empty())
    throw std::invalid_argument("the instruction \"" + std::string(instruction) + "\" holds no word");
  return out;
}

}  // namespace flowscope
