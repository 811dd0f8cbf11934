// A stack of Mamba blocks without autograd: every thread takes a few tokens through all the blocks while they
// stay in its cache, one block behind the thread that has the tokens before them.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <vector>

#include "policy/backbone.h"
#include "policy/fused_block.h"

namespace flowscope {

/// Owns its working memory, which grows to the largest call and is then kept; calls on one stack take turns.
class FusedStack {
 public:
  explicit FusedStack(const MambaKernels& kernels = *supported_mamba_kernels().front()) : kernels_(kernels) {}
  /// As BackboneImpl::forward_from, without gradients, for at least one block, all alike; everything float32
  /// on the CPU. Reads the blocks' parameters as they are now. Bit-equal for any thread count.
  /// std::invalid_argument for what does not fit.
  torch::Tensor run(const std::vector<MambaBlock>& blocks, BackboneState& state, const torch::Tensor& x,
                    const torch::Tensor& condition);

 private:
  struct Sizes {
    std::int64_t items, length, blocks, chunk_rows, chunks, d_model, tail, h;
  };
  /// One block's memory for every item.
  struct Layer {
    FusedBlock block;
    AlignedFloats conv_tail, h, gain, offset;
  };
  void read_block(const Sizes& sizes, std::size_t index, const MambaBlock& block,
                  const torch::Tensor& condition, const BackboneState& state);
  void take_chunks(const Sizes& sizes, float* x, float* scratch);
  BackboneState remembered(const Sizes& sizes, const std::vector<MambaBlock>& blocks) const;

  const MambaKernels& kernels_;
  std::mutex turn_;
  std::vector<Layer> layers_;
  std::vector<AlignedFloats> scratch_;  // one per thread
  // How many blocks each (chunk, item) has been through.
  std::unique_ptr<std::atomic<int>[]> progress_;
  std::int64_t progress_size_ = 0;
  std::atomic<std::int64_t> next_{0};
};

}  // namespace flowscope
