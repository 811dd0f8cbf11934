#include "policy/fused_stack.h"

#include <ATen/Parallel.h>

#include <algorithm>
#include <thread>

#include "policy/flush_denormals.h"
#include "policy/tensor_rows.h"

namespace flowscope {
namespace {

/// Tokens that go through a block together at most: their activations and a block's weights fit a core's
/// second-level cache of 2 MB at the paper's size.
constexpr std::int64_t kMostRows = 128;

/// Equal chunks, as many for every thread, of whole tiles of rows. Cuts change no result: each token's sums
/// are taken in the same order.
std::int64_t chunk_rows(std::int64_t length, std::int64_t threads) {
  constexpr std::int64_t kTile = 8;
  const std::int64_t rounds = (length + threads * kMostRows - 1) / (threads * kMostRows);
  const std::int64_t rows = (length + rounds * threads - 1) / (rounds * threads);
  return (rows + kTile - 1) / kTile * kTile;
}

/// Until the thread with the tokens before these has done its part.
void wait_until_above(const std::atomic<int>& value, int bound) {
  constexpr int kSpins = 2000;
  for (int spins = 0; value.load(std::memory_order_acquire) <= bound; ++spins) {
    if (spins > kSpins) std::this_thread::yield();
  }
}

void require_state(const std::vector<MambaBlock>& blocks, const BackboneState& state, std::int64_t items) {
  if (state.empty()) return;
  if (state.size() != blocks.size()) {
    throw std::invalid_argument("MambaStack: a state of " + std::to_string(blocks.size()) + " blocks, not " +
                                std::to_string(state.size()));
  }
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const MambaOptions& o = blocks[i]->options;
    const std::int64_t channels = std::int64_t{o.d_model} * o.expand;
    const auto& [tail, h] = state[i];
    if (tail.defined()) require_float("MambaStack", "conv_tail", tail, {items, o.d_conv - 1, channels});
    if (h.defined()) require_float("MambaStack", "state", h, {items, channels, o.d_state});
  }
}

/// `state` of `count` floats, undefined for zeros.
void copy_state(const torch::Tensor& state, std::int64_t count, float* to) {
  if (!state.defined()) {
    std::fill_n(to, count, 0.f);
    return;
  }
  const torch::Tensor dense = state.contiguous();
  std::copy_n(dense.data_ptr<float>(), count, to);
}

}  // namespace

void FusedStack::read_block(const Sizes& s, std::size_t index, const MambaBlock& block,
                            const torch::Tensor& condition, const BackboneState& state) {
  Layer& layer = layers_[index];
  const MambaWeights weights = block->weights();
  layer.block.read_weights(kernels_, block->options, weights);
  layer.gain.reserve(s.items * s.d_model), layer.offset.reserve(s.items * s.d_model);
  layer.block.read_condition(kernels_, weights, condition, s.items, layer.gain.data(), layer.offset.data());
  layer.conv_tail.reserve(s.items * s.tail), layer.h.reserve(s.items * s.h);
  const auto [tail, h] = state.empty() ? std::pair<torch::Tensor, torch::Tensor>{} : state[index];
  copy_state(tail, s.items * s.tail, layer.conv_tail.data());
  copy_state(h.defined() ? h.transpose(1, 2) : h, s.items * s.h, layer.h.data());
}

/// Chunks are taken in the order of their tokens, so whoever waits waits for a thread that is at work.
void FusedStack::take_chunks(const Sizes& s, float* x, float* scratch) {
  const FlushDenormals flush;
  for (std::int64_t task = next_++; task < s.chunks * s.items; task = next_++) {
    const std::int64_t item = task % s.items, first = task / s.items * s.chunk_rows;
    FusedTokens tokens;
    tokens.rows = std::min(s.chunk_rows, s.length - first);
    tokens.x = x + (item * s.length + first) * s.d_model;
    for (int b = 0; b < s.blocks; ++b) {
      Layer& layer = layers_[static_cast<std::size_t>(b)];
      if (first > 0) wait_until_above(progress_[task - s.items], b);
      tokens.conv_tail = layer.conv_tail.data() + item * s.tail, tokens.h = layer.h.data() + item * s.h;
      tokens.gain = layer.gain.data() + item * s.d_model;
      tokens.offset = layer.offset.data() + item * s.d_model;
      layer.block.run(kernels_, tokens, scratch);
      progress_[task].store(b + 1, std::memory_order_release);
    }
  }
}

BackboneState FusedStack::remembered(const Sizes& s, const std::vector<MambaBlock>& blocks) const {
  BackboneState state;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const MambaOptions& o = blocks[i]->options;
    const std::int64_t channels = std::int64_t{o.d_model} * o.expand;
    const torch::Tensor tail = torch::empty({s.items, o.d_conv - 1, channels}),
                        h = torch::empty({s.items, o.d_state, channels});
    std::copy_n(layers_[i].conv_tail.data(), tail.numel(), tail.data_ptr<float>());
    std::copy_n(layers_[i].h.data(), h.numel(), h.data_ptr<float>());
    state.emplace_back(tail, h.transpose(1, 2));
  }
  return state;
}

torch::Tensor FusedStack::run(const std::vector<MambaBlock>& blocks, BackboneState& state,
                              const torch::Tensor& x, const torch::Tensor& condition) {
  require_block_input(blocks.front()->options, x, condition);
  require_state(blocks, state, x.size(0));
  const std::lock_guard turn(turn_);
  const torch::NoGradGuard no_grad;
  const torch::Tensor y = x.clone(at::MemoryFormat::Contiguous);
  const torch::Tensor activated = condition.defined() ? torch::silu(condition) : condition;
  const MambaOptions& o = blocks.front()->options;
  const std::int64_t channels = std::int64_t{o.d_model} * o.expand;
  Sizes s{};
  s.items = x.size(0), s.length = x.size(1), s.d_model = o.d_model;
  s.blocks = static_cast<std::int64_t>(blocks.size());
  s.chunk_rows = chunk_rows(s.length, at::get_num_threads()),
  s.chunks = (s.length + s.chunk_rows - 1) / s.chunk_rows;
  s.tail = (o.d_conv - 1) * channels, s.h = o.d_state * channels;

  layers_.resize(blocks.size());
  at::parallel_for(0, s.blocks, 1, [&](std::int64_t begin, std::int64_t end) {
    const torch::NoGradGuard on_this_thread_too;
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
      read_block(s, i, blocks[i], activated, state);
    }
  });

  const std::int64_t tasks = s.chunks * s.items;
  if (tasks > progress_size_) {
    progress_.reset(new std::atomic<int>[static_cast<std::size_t>(tasks)]);
    progress_size_ = tasks;
  }
  for (std::int64_t i = 0; i < tasks; ++i) progress_[i].store(0, std::memory_order_relaxed);
  next_ = 0;
  const std::int64_t threads = std::min<std::int64_t>(at::get_num_threads(), tasks);
  scratch_.resize(std::max(scratch_.size(), static_cast<std::size_t>(threads)));
  for (auto& part : scratch_) part.reserve(layers_.front().block.scratch_floats(s.chunk_rows));
  at::parallel_for(0, threads, 1, [&](std::int64_t begin, std::int64_t) {
    take_chunks(s, y.data_ptr<float>(), scratch_[static_cast<std::size_t>(begin)].data());
  });
  state = remembered(s, blocks);
  return y;
}

}  // namespace flowscope
