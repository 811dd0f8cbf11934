#include "policy/fused_block.h"

#include <algorithm>
#include <cmath>

namespace flowscope {
namespace {

constexpr float kNormEpsilon = 1e-5f;  // torch's default, which MambaBlock uses
constexpr std::int64_t kLineFloats = 16;

void copy_of(const torch::Tensor& parameter, AlignedFloats& to) {
  const torch::Tensor dense = parameter.contiguous();
  to.reserve(dense.numel());
  std::copy_n(dense.data_ptr<float>(), dense.numel(), to.data());
}

void packed(const MambaKernels& kernels, const torch::Tensor& weight, AlignedFloats& to) {
  const torch::Tensor dense = weight.contiguous();
  const std::int64_t outputs = dense.size(0), inputs = dense.size(1);
  to.reserve(kernels.packed_floats(inputs, outputs));
  kernels.pack(dense.data_ptr<float>(), inputs, outputs, to.data());
}

/// The last `kept` rows of the tail and the tokens together become the tail.
void move_tail(float* tail, const float* x, std::int64_t stride, std::int64_t rows, std::int64_t kept,
               std::int64_t channels) {
  for (std::int64_t k = 0; k < kept; ++k) {
    const std::int64_t row = rows - kept + k;
    const float* from = row >= 0 ? x + row * stride : tail + (kept + row) * channels;
    std::copy_n(from, channels, tail + k * channels);
  }
}

}  // namespace

void FusedBlock::read_weights(const MambaKernels& kernels, const MambaOptions& options,
                              const MambaWeights& w) {
  d_model_ = options.d_model, channels_ = d_model_ * options.expand, d_state_ = options.d_state;
  taps_ = options.d_conv, rank_ = w.dt_weight.size(1);
  packed(kernels, w.in_proj, in_proj_);
  packed(kernels, w.x_proj, x_proj_);
  packed(kernels, w.dt_weight, dt_proj_);
  packed(kernels, w.out_proj, out_proj_);
  copy_of(w.conv_weight, conv_weight_);
  copy_of(w.conv_bias, conv_bias_);
  copy_of(w.dt_bias, dt_bias_);
  copy_of(w.D, D_);
  const torch::Tensor A_log = w.A_log.contiguous();
  const float* from = A_log.data_ptr<float>();
  A_.reserve(d_state_ * channels_);
  for (std::int64_t c = 0; c < channels_; ++c) {
    for (std::int64_t n = 0; n < d_state_; ++n) A_.data()[n * channels_ + c] = -std::exp(*from++);
  }
}

void FusedBlock::read_condition(const MambaKernels& kernels, const MambaWeights& w,
                                const torch::Tensor& condition, std::int64_t items, float* gain,
                                float* offset) {
  for (std::int64_t item = 0; item < items; ++item) {
    std::copy_n(w.norm_weight.data_ptr<float>(), d_model_, gain + item * d_model_);
    std::copy_n(w.norm_bias.data_ptr<float>(), d_model_, offset + item * d_model_);
  }
  if (!condition.defined()) return;
  // norm (1 + scale) + shift, with [scale, shift] the adaptive layer of the condition; the items take the
  // weights' place in the product, for they are few and need not be laid out anew like the matrix.
  const torch::Tensor matrix = w.adaptive_weight.contiguous();
  const std::int64_t inputs = matrix.size(1);
  packed(kernels, condition, condition_);
  scale_shift_.reserve(2 * d_model_ * items);
  kernels.multiply({2 * d_model_,
                    inputs,
                    items,
                    {matrix.data_ptr<float>(), inputs},
                    condition_.data(),
                    scale_shift_.data(),
                    items});
  const float* bias = w.adaptive_bias.data_ptr<float>();
  for (std::int64_t item = 0; item < items; ++item, gain += d_model_, offset += d_model_) {
    for (std::int64_t c = 0; c < d_model_; ++c) {
      const float scale = scale_shift_.data()[c * items + item] + bias[c];
      const float shift = scale_shift_.data()[(d_model_ + c) * items + item] + bias[d_model_ + c];
      gain[c] *= 1 + scale;
      offset[c] = offset[c] * (1 + scale) + shift;
    }
  }
}

std::int64_t FusedBlock::scratch_floats(std::int64_t rows) const {
  return rows * (2 * channels_ + 2 * widest() + rank_ + 2 * d_state_) + 4 * kLineFloats;
}

void FusedBlock::run(const MambaKernels& kernels, const FusedTokens& t, float* scratch) const {
  const std::int64_t rows = t.rows, columns = rank_ + 2 * d_state_;
  const auto take = [&](std::int64_t width) {
    float* part = scratch;
    scratch += (rows * width + kLineFloats - 1) / kLineFloats * kLineFloats;
    return part;
  };
  // What is dead makes room: the fewer lines, the more of a block stays in the cache.
  float *xz = take(2 * channels_), *u = take(widest()), *delta = take(widest()), *parts = take(columns);
  float *normed = delta, *y = u;

  kernels.layer_norm({rows, d_model_, t.x, t.gain, t.offset, kNormEpsilon, normed});
  kernels.multiply({rows, d_model_, 2 * channels_, {normed, d_model_}, in_proj_.data(), xz, 2 * channels_});

  ConvInputs conv;
  conv.batch = 1, conv.length = rows, conv.channels = channels_, conv.taps = taps_;
  conv.x = {xz, 2 * channels_}, conv.weight = conv_weight_.data(), conv.bias = conv_bias_.data();
  conv.tail = t.conv_tail;
  kernels.conv_forward(conv, u, 0);
  move_tail(t.conv_tail, xz, 2 * channels_, rows, taps_ - 1, channels_);

  kernels.multiply({rows, channels_, columns, {u, channels_}, x_proj_.data(), parts, columns});
  kernels.multiply({rows, rank_, channels_, {parts, columns}, dt_proj_.data(), delta, channels_});
  kernels.softplus(delta, dt_bias_.data(), rows, channels_);

  ScanInputs scan;
  scan.shape = {1, rows, channels_, d_state_};
  scan.u = {u, channels_}, scan.delta = {delta, channels_}, scan.z = {xz + channels_, 2 * channels_};
  scan.B = {parts + rank_, columns}, scan.C = {parts + rank_ + d_state_, columns};
  scan.A = A_.data(), scan.D = D_.data(), scan.h0 = t.h;
  kernels.scan_forward(scan, {y, nullptr, t.h}, 0, 0, kernels.blocks(channels_));

  kernels.multiply({rows, channels_, d_model_, {y, channels_}, out_proj_.data(), t.x, d_model_, true});
}

}  // namespace flowscope
