#include "policy/backbone.h"

#include <stdexcept>

#include "policy/mamba_stack.h"
#include "policy/transformer.h"

namespace flowscope {

BackboneState repeat_rows(const BackboneState& state, std::int64_t draws) {
  if (draws == 1) return state;
  BackboneState out;
  for (const auto& [a, b] : state)
    out.emplace_back(a.repeat_interleave(draws, 0), b.repeat_interleave(draws, 0));
  return out;
}

Backbone make_backbone(const std::string& kind, const BackboneOptions& options) {
  if (kind == "mamba") return std::make_shared<MambaStack>(options);
  if (kind == "transformer") return make_transformer(options);
  throw std::invalid_argument("backbone '" + kind + "' is not available; there are: mamba, transformer");
}

}  // namespace flowscope
