#include "policy/mamba_stack.h"

#include <string>

#include "policy/packed_layer.h"
#include "policy/plain_scan.h"

namespace flowscope {

MambaStack::MambaStack(const BackboneOptions& o) {
  for (int i = 0; i < o.blocks; ++i) {
    blocks_.push_back(register_module("block" + std::to_string(i),
                                      MambaBlock(MambaOptions{.d_model = o.channels,
                                                              .d_state = o.d_state,
                                                              .d_conv = 4,
                                                              .expand = 2,
                                                              .condition_dim = o.condition_dim})));
  }
}

torch::Tensor MambaStack::forward(const torch::Tensor& x, const torch::Tensor& condition) {
  BackboneState nothing;
  return forward_from(nothing, x, condition);
}

torch::Tensor MambaStack::forward_from(BackboneState& state, const torch::Tensor& x,
                                       const torch::Tensor& condition) {
  if (runs_fused(x)) return fused_.run(blocks_, state, x, condition);
  state.resize(blocks_.size());
  torch::Tensor y = x;
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    MambaState block{state[i].first, state[i].second};
    y = blocks_[i]->forward_from(block, y, condition);
    state[i] = {block.conv_tail, block.h};
  }
  return y;
}

void MambaStack::run_by(ScanPath path) {
  path_ = path;
  for (MambaBlock& block : blocks_) block->scan_by(path == ScanPath::plain ? plain_scan : selective_scan);
}

bool MambaStack::runs_fused(const torch::Tensor& x) const {
  return path_ == ScanPath::fused && !blocks_.empty() && plain_arrays(x, blocks_.front()->weights().in_proj);
}

}  // namespace flowscope
