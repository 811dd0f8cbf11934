#include "policy/clip/text_branch.h"

#include <algorithm>
#include <stdexcept>

namespace flowscope {

ClipText encode_texts(const ClipEncoders& encoders, const std::vector<std::string>& texts, int limit) {
  if (!encoders.text || !encoders.tokenizer)
    throw std::invalid_argument("clip text: the weights hold no text part");
  if (texts.empty()) throw std::invalid_argument("clip text: there is no text");
  ClipText out;
  std::size_t longest = 0;
  const int most = std::min<int>(limit, static_cast<int>(encoders.text->context()));
  for (const std::string& text : texts) {
    out.tokens.push_back(encoders.tokenizer->encode(text, most));
    longest = std::max(longest, out.tokens.back().size());
  }
  const auto rows = static_cast<std::int64_t>(texts.size()), columns = static_cast<std::int64_t>(longest);
  torch::Tensor ids = torch::full({rows, columns}, encoders.tokenizer->end(), torch::kInt64);
  out.is_token = torch::zeros({rows, columns});
  for (std::int64_t s = 0; s < rows; ++s) {
    const auto& tokens = out.tokens[static_cast<std::size_t>(s)];
    for (std::size_t w = 0; w < tokens.size(); ++w) {
      ids[s][static_cast<std::int64_t>(w)] = tokens[w].id;
      out.is_token[s][static_cast<std::int64_t>(w)] = 1;
    }
  }
  const torch::Tensor hidden = encoders.text->forward(ids);
  out.is_token = out.is_token.to(hidden.device());
  out.hidden = hidden * out.is_token.unsqueeze(-1);
  return out;
}

}  // namespace flowscope
