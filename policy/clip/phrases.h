// Instructions as words of the policy whose features come from CLIP's text transformer.
#pragma once

#include <memory>

#include "policy/clip/weights.h"
#include "policy/torch_parts.h"
#include "policy/words.h"

namespace flowscope {

/// One word per token, start and end included. A token of a colour word keeps that colour and which mention
/// of a colour it is, so that points are bound to words as with the learnt table. Any thread; slow (one pass
/// of the transformer), so once per instruction.
class ClipPhrases : public PhraseEncoder {
 public:
  /// Throws std::invalid_argument when the encoders hold no text part.
  explicit ClipPhrases(std::shared_ptr<const ClipEncoders> encoders);
  std::vector<Word> encode(const std::string& instruction, int limit) const override;

 private:
  std::shared_ptr<const ClipEncoders> encoders_;
};

}  // namespace flowscope
