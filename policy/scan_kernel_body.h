// Forward and backward of the selective scan for W channels at a time; see policy/selective_scan.h for the
// maths. Included once per instruction set, by policy/mamba_kernels_*.cc.
#pragma once

#include "policy/mamba_kernels.h"
#include "policy/simd.h"

namespace flowscope {

/// kStates 0: the number of states is read from the shape; otherwise it must equal the shape's.
template <int W, int kStates>
class ScanBody {
  using S = Simd<W>;
  using Float = typename S::Float;
  using Lanes = typename S::Lanes;
  static constexpr int kCapacity = kStates > 0 ? kStates : kMaxScanStates;

  static int state_count(const ScanShape& shape) {
    return kStates > 0 ? kStates : static_cast<int>(shape.states);
  }
  static std::int64_t chunk_end(const ScanShape& shape, std::int64_t chunk) {
    const std::int64_t end = (chunk + 1) * kScanChunk;
    return end < shape.length ? end : shape.length;
  }
  /// [states, channels] starting at `from`, one block of it.
  static void load_states(Float* to, const float* from, int states, std::int64_t channels, Lanes lanes) {
#pragma GCC unroll 16
    for (int n = 0; n < states; ++n) to[n] = S::load(from + n * channels, lanes);
  }
  static void store_states(float* to, const Float* from, int states, std::int64_t channels, Lanes lanes) {
#pragma GCC unroll 16
    for (int n = 0; n < states; ++n) S::store(to + n * channels, from[n], lanes);
  }

 public:
  static void forward(const ScanInputs& in, const ScanOutputs& out, std::int64_t item,
                      std::int64_t first_block, std::int64_t last_block) {
    const ScanShape& shape = in.shape;
    const int states = state_count(shape);
    const std::int64_t channels = shape.channels, item_states = shape.states * channels;
    for (std::int64_t block = first_block; block < last_block; ++block) {
      const std::int64_t c = block * W;
      const Lanes lanes = S::block_lanes(channels, c);
      Float h[kCapacity] = {}, rate[kCapacity];  // rate: A in units of log2
#pragma GCC unroll 16
      for (int n = 0; n < states; ++n) rate[n] = S::load(in.A + n * channels + c, lanes) * S::kLog2E;
      if (in.h0) load_states(h, in.h0 + item * item_states + c, states, channels, lanes);
      const Float D = S::load(in.D + c, lanes);
      for (std::int64_t chunk = 0; chunk < shape.chunks(); ++chunk) {
        if (out.chunk_states) {
          float* to = out.chunk_states + (item * shape.chunks() + chunk) * item_states + c;
          store_states(to, h, states, channels, lanes);
        }
        for (std::int64_t l = chunk * kScanChunk; l < chunk_end(shape, chunk); ++l) {
          const std::int64_t row = item * shape.length + l;
          const Float u = S::load(in.u.row(row) + c, lanes);
          const Float delta = S::load(in.delta.row(row) + c, lanes);
          const float *B = in.B.row(row), *C = in.C.row(row);
          const Float delta_u = delta * u;
          Float y = D * u;
#pragma GCC unroll 16
          for (int n = 0; n < states; ++n) {
            h[n] = S::exp2_of_product(delta, rate[n]) * h[n] + delta_u * B[n];
            y += h[n] * C[n];
          }
          if (in.z.data) {
            const Float z = S::load(in.z.row(row) + c, lanes);
            y *= z * S::sigmoid(z);
          }
          S::store(out.y + row * channels + c, y, lanes);
        }
      }
      if (out.last_state) store_states(out.last_state + item * item_states + c, h, states, channels, lanes);
    }
  }

 private:
  /// The scratch of one item, cut into its parts; every vector is W floats.
  struct Scratch {
    float* carry;                // [blocks, states]: gradient of the state, carried from the later chunk
    float *h, *decay;            // [chunk + 1, states], [chunk, states]
    float *dB_lanes, *dC_lanes;  // [chunk, states], summed over the blocks
  };
  static Scratch cut(float* memory, std::int64_t blocks, int states) {
    const std::int64_t step = static_cast<std::int64_t>(states) * W;
    Scratch s;
    s.carry = memory;
    s.h = s.carry + blocks * step;
    s.decay = s.h + (kScanChunk + 1) * step;
    s.dB_lanes = s.decay + kScanChunk * step;
    s.dC_lanes = s.dB_lanes + kScanChunk * step;
    return s;
  }

  /// [batch, states, channels] or null for zeros -> the carry of one item, and back.
  static void carry_in(const ScanShape& shape, const float* from, std::int64_t item, float* carry) {
    const int states = state_count(shape);
    for (std::int64_t c = 0; c < shape.channels; c += W) {
      const Lanes lanes = S::block_lanes(shape.channels, c);
      for (int n = 0; n < states; ++n) {
        const std::int64_t at = (item * states + n) * shape.channels + c;
        S::store(carry + c * states + n * W, from ? S::load(from + at, lanes) : Float{});
      }
    }
  }
  static void carry_out(const ScanShape& shape, const float* carry, std::int64_t item, float* to) {
    const int states = state_count(shape);
    for (std::int64_t c = 0; c < shape.channels; c += W) {
      const Lanes lanes = S::block_lanes(shape.channels, c);
      for (int n = 0; n < states; ++n) {
        const std::int64_t at = (item * states + n) * shape.channels + c;
        S::store(to + at, S::load(carry + c * states + n * W), lanes);
      }
    }
  }

  /// Runs the chunk forward again, keeping every state and decay, and C h of every token for the gate.
  static void recompute(const ScanInputs& in, const float* start, std::int64_t row, int steps, std::int64_t c,
                        Lanes lanes, float* __restrict h_out, float* __restrict decay_out, Float* y) {
    const std::int64_t channels = in.shape.channels;
    const int states = state_count(in.shape);
    Float h[kCapacity], rate[kCapacity];
    load_states(h, start + c, states, channels, lanes);
#pragma GCC unroll 16
    for (int n = 0; n < states; ++n) {
      rate[n] = S::load(in.A + n * channels + c, lanes) * S::kLog2E;
      S::store(h_out + n * W, h[n]);
    }
    for (int i = 0; i < steps; ++i) {
      const Float delta = S::load(in.delta.row(row + i) + c, lanes);
      const Float delta_u = delta * S::load(in.u.row(row + i) + c, lanes);
      const float *B = in.B.row(row + i), *C = in.C.row(row + i);
      float* h_step = h_out + (i + 1) * states * W;
      float* decay_step = decay_out + i * states * W;
      Float sum{};
#pragma GCC unroll 16
      for (int n = 0; n < states; ++n) {
        const Float decay = S::exp2_of_product(delta, rate[n]);
        h[n] = decay * h[n] + delta_u * B[n];
        sum += h[n] * C[n];
        S::store(decay_step + n * W, decay);
        S::store(h_step + n * W, h[n]);
      }
      y[i] = sum;
    }
  }

  /// dy -> the gradient of y before the gate; writes dz.
  static Float through_gate(const ScanInputs& in, const ScanGradients& grad, std::int64_t row, std::int64_t c,
                            Lanes lanes, Float y) {
    const std::int64_t at = row * in.shape.channels + c;
    const Float dy = S::load(grad.dy + at, lanes);
    if (!in.z.data) return dy;
    const Float z = S::load(in.z.row(row) + c, lanes), s = S::sigmoid(z);
    S::store(grad.dz + at, dy * y * (s * (1.f + z * (1.f - s))), lanes);
    return dy * (z * s);
  }

  /// One token of one block, backward; `at_token` parts point at that token's vectors.
  struct Token {
    const float *B, *C, *h_before, *h_after, *decay;
    float *dB_lanes, *dC_lanes;
    Float u, delta, dy;
  };
  struct Sums {
    Float dh_B, decay_A;
  };
  static Sums step_back(const Token& t, const Float* A, int states, float* __restrict carry,
                        float* __restrict dA) {
    const Float delta_u = t.delta * t.u;
    Sums sums{};
#pragma GCC unroll 16
    for (int n = 0; n < states; ++n) {
      const int at = n * W;
      const Float dh = S::load(carry + at) + t.dy * t.C[n];
      S::store(t.dC_lanes + at, S::load(t.dC_lanes + at) + t.dy * S::load(t.h_after + at));
      S::store(t.dB_lanes + at, S::load(t.dB_lanes + at) + dh * delta_u);
      sums.dh_B += dh * t.B[n];
      const Float passed = dh * S::load(t.decay + at);
      const Float d_exponent = passed * S::load(t.h_before + at);
      sums.decay_A += d_exponent * A[n];
      S::store(dA + at, S::load(dA + at) + d_exponent * t.delta);
      S::store(carry + at, passed);
    }
    return sums;
  }

 public:
  static void backward(const ScanInputs& in, const ScanGradients& grad, std::int64_t item, float* memory) {
    const ScanShape& shape = in.shape;
    const int states = state_count(shape);
    const std::int64_t channels = shape.channels, blocks = (channels + W - 1) / W, step = states * W;
    const Scratch scratch = cut(memory, blocks, states);
    float* dA_item = grad.dA + item * blocks * step;
    float* dD_item = grad.dD + item * blocks * W;
    for (std::int64_t i = 0; i < blocks * step; ++i) dA_item[i] = 0;
    carry_in(shape, grad.dlast_state, item, scratch.carry);
    for (std::int64_t i = 0; i < blocks * W; ++i) dD_item[i] = 0;

    for (std::int64_t chunk = shape.chunks() - 1; chunk >= 0; --chunk) {
      const std::int64_t first = chunk * kScanChunk, row = item * shape.length + first;
      const int steps = static_cast<int>(chunk_end(shape, chunk) - first);
      const float* start = grad.chunk_states + (item * shape.chunks() + chunk) * states * channels;
      for (std::int64_t i = 0; i < steps * step; ++i) scratch.dB_lanes[i] = scratch.dC_lanes[i] = 0;

      for (std::int64_t block = 0; block < blocks; ++block) {
        const std::int64_t c = block * W;
        const Lanes lanes = S::block_lanes(channels, c);
        Float y[kScanChunk], A[kCapacity];
        recompute(in, start, row, steps, c, lanes, scratch.h, scratch.decay, y);
        load_states(A, in.A + c, states, channels, lanes);
        const Float D = S::load(in.D + c, lanes);
        Float dD = S::load(dD_item + c);
        for (int i = steps - 1; i >= 0; --i) {
          Token t;
          t.B = in.B.row(row + i), t.C = in.C.row(row + i);
          t.h_before = scratch.h + i * step, t.h_after = t.h_before + step;
          t.decay = scratch.decay + i * step;
          t.dB_lanes = scratch.dB_lanes + i * step, t.dC_lanes = scratch.dC_lanes + i * step;
          t.u = S::load(in.u.row(row + i) + c, lanes), t.delta = S::load(in.delta.row(row + i) + c, lanes);
          t.dy = through_gate(in, grad, row + i, c, lanes, y[i] + D * t.u);
          const Sums sums = step_back(t, A, states, scratch.carry + block * step, dA_item + block * step);
          dD += t.dy * t.u;
          const std::int64_t at = (row + i) * channels + c;
          S::store(grad.du + at, t.dy * D + t.delta * sums.dh_B, lanes);
          S::store(grad.ddelta + at, t.u * sums.dh_B + sums.decay_A, lanes);
        }
        S::store(dD_item + c, dD);
      }
      for (int i = 0; i < steps * states; ++i) {
        grad.dB[row * states + i] = S::sum(S::load(scratch.dB_lanes + i * W));
        grad.dC[row * states + i] = S::sum(S::load(scratch.dC_lanes + i * W));
      }
    }
    if (grad.dh0) carry_out(shape, scratch.carry, item, grad.dh0);
  }
};

template <int W>
void scan_forward(const ScanInputs& in, const ScanOutputs& out, std::int64_t item, std::int64_t first_block,
                  std::int64_t last_block) {
  if (in.shape.states == 16) return ScanBody<W, 16>::forward(in, out, item, first_block, last_block);
  if (in.shape.states == 8) return ScanBody<W, 8>::forward(in, out, item, first_block, last_block);
  ScanBody<W, 0>::forward(in, out, item, first_block, last_block);
}

template <int W>
void scan_backward(const ScanInputs& in, const ScanGradients& grad, std::int64_t item, float* scratch) {
  if (in.shape.states == 16) return ScanBody<W, 16>::backward(in, grad, item, scratch);
  if (in.shape.states == 8) return ScanBody<W, 8>::backward(in, grad, item, scratch);
  ScanBody<W, 0>::backward(in, grad, item, scratch);
}

}  // namespace flowscope
