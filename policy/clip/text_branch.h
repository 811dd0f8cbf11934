// Instructions as CLIP's text transformer sees them: a frozen vector per token, and which word each token is
// of. What makes them the policy's tokens, a Linear of width 512 to C, is the network's and learns.
#pragma once

#include <string>
#include <vector>

#include "policy/clip/weights.h"
#include "policy/torch_parts.h"

namespace flowscope {

/// The published policies' limit of tokens per instruction (3D Diffuser Actor, after RVT and PerAct).
inline constexpr int clip_words = 53;

struct ClipText {
  torch::Tensor hidden;    ///< float32 [S, W, 512], zero behind the last token; no gradient
  torch::Tensor is_token;  ///< float32 [S, W], 1 for tokens, 0 for what pads
  std::vector<std::vector<ClipToken>> tokens;  ///< [S][at most W] with the word that each is of
};

/// W is the longest instruction, at most `limit` tokens; longer ones are cut before their end token. An
/// instruction's vectors do not depend on what stands beside it. Constant for fixed weights, so once per
/// instruction is enough. Throws std::invalid_argument for no texts, a text that is not UTF-8, and encoders
/// without a text part.
ClipText encode_texts(const ClipEncoders& encoders, const std::vector<std::string>& texts,
                      int limit = clip_words);

}  // namespace flowscope
