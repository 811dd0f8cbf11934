// The ablation's other backbone: a pre-norm transformer behind the same seam as Mamba.
#pragma once

#include "policy/backbone.h"
#include "policy/torch_parts.h"

namespace flowscope {

/// Blocks x + MHA(LN(x)), then x + FFN(LN(x)) with GELU (Vaswani et al. 2017, arXiv 1706.03762, pre-norm).
/// Tokens of one call see each other fully, and all that the state remembers; what is remembered does not see
/// what comes later, so a prefix may be encoded by itself. There are no positions: tokens that need one carry
/// it. With a condition both norms are adaptive, x (1 + scale) + shift, zero-initialised.
///
/// The feed-forward's width is 1.5 channels instead of the usual 4, which gives a block the parameters of a
/// Mamba block with expand 2: the comparison is of how tokens are mixed, not of size. Heads: the most up to 8
/// that divide the channels and are 8 wide or wider. d_state does not count here. State: keys and values [B,
/// heads, L, channels / heads] of every block. Differentiable in both forms, also through the state. Throws
/// std::invalid_argument for sizes or arguments that do not fit.
Backbone make_transformer(const BackboneOptions& options);

}  // namespace flowscope
