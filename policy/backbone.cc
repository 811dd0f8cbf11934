#include "policy/backbone.h"

#include <stdexcept>
#include <vector>

#include "policy/mamba.h"
#include "policy/plain_scan.h"
#include "policy/transformer.h"

namespace flowscope {
namespace {

class MambaStack : public BackboneImpl {
 public:
  explicit MambaStack(const BackboneOptions& o) {
    for (int i = 0; i < o.blocks; ++i)
      blocks_.push_back(register_module("block" + std::to_string(i),
                                        MambaBlock(MambaOptions{.d_model = o.channels,
                                                                .d_state = o.d_state,
                                                                .d_conv = 4,
                                                                .expand = 2,
                                                                .condition_dim = o.condition_dim})));
  }
  torch::Tensor forward(const torch::Tensor& x, const torch::Tensor& condition) override {
    torch::Tensor y = x;
    for (MambaBlock& block : blocks_) y = block->forward(y, condition);
    return y;
  }
  torch::Tensor forward_from(BackboneState& state, const torch::Tensor& x,
                             const torch::Tensor& condition) override {
    state.resize(blocks_.size());
    torch::Tensor y = x;
    for (std::size_t i = 0; i < blocks_.size(); ++i) {
      MambaState block{state[i].first, state[i].second};
      y = blocks_[i]->forward_from(block, y, condition);
      state[i] = {block.conv_tail, block.h};
    }
    return y;
  }
  void run_by(ScanPath path) override {
    for (MambaBlock& block : blocks_) block->scan_by(path == ScanPath::plain ? plain_scan : selective_scan);
  }

 private:
  std::vector<MambaBlock> blocks_;
};

}  // namespace

BackboneState repeat_rows(const BackboneState& state, std::int64_t draws) {
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
