#include "policy/clip/phrases.h"

#include <algorithm>
#include <stdexcept>

#include "policy/clip/text_branch.h"

namespace flowscope {

ClipPhrases::ClipPhrases(std::shared_ptr<const ClipEncoders> encoders) : encoders_(std::move(encoders)) {
  if (!encoders_ || !encoders_->text || !encoders_->tokenizer)
    throw std::invalid_argument("the text branch 'clip' needs CLIP weights with a text part");
}

std::vector<Word> ClipPhrases::encode(const std::string& instruction, int limit) const {
  const torch::NoGradGuard no_grad;
  const ClipText text = encode_texts(*encoders_, {instruction}, std::min(limit, clip_words));
  const torch::Tensor hidden = text.hidden[0].cpu().contiguous();
  const auto width = static_cast<std::size_t>(hidden.size(1));
  std::vector<Word> words;
  int mentions = 0;
  std::string before;
  for (const ClipToken& token : text.tokens.front()) {
    const float* row = hidden.data_ptr<float>() + words.size() * width;
    Word word;
    word.row = Vocabulary::unknown;
    word.feature = std::make_shared<const std::vector<float>>(row, row + width);
    if (const auto rgb = color_of_word(token.piece)) {
      if (token.piece != before) ++mentions;  // a word may be several tokens
      word.row = Vocabulary::color;
      word.mention = mentions;
      word.color = *rgb;
    }
    before = token.piece;
    words.push_back(std::move(word));
  }
  return words;
}

}  // namespace flowscope
