// The inner loops of a Mamba block on plain arrays, once per instruction set. No torch here.
#pragma once

#include <cstdint>
#include <vector>

namespace flowscope {

/// A matrix whose rows are contiguous but may lie apart: row r starts at data + r * stride.
struct Rows {
  const float* data = nullptr;
  std::int64_t stride = 0;
  [[gnu::always_inline]] const float* row(std::int64_t r) const { return data + r * stride; }
};

inline constexpr int kMaxScanStates = 64;
/// Steps between two stored states; the backward pass recomputes what lies between them.
inline constexpr std::int64_t kScanChunk = 16;

struct ScanShape {
  std::int64_t batch = 0, length = 0, channels = 0, states = 0;
  [[gnu::always_inline]] std::int64_t chunks() const { return (length + kScanChunk - 1) / kScanChunk; }
};

/// Row b * length + l of u, delta, z, B and C belongs to token l of item b.
struct ScanInputs {
  ScanShape shape;
  Rows u, delta, z;           ///< [batch * length, channels]; z.data null: no gate
  Rows B, C;                  ///< [batch * length, states]
  const float* A = nullptr;   ///< [states, channels] (transposed)
  const float* D = nullptr;   ///< [channels]
  const float* h0 = nullptr;  ///< [batch, states, channels] or null for zeros
};

struct ScanOutputs {
  float* y = nullptr;  ///< [batch, length, channels]
  float* chunk_states =
      nullptr;  ///< [batch, chunks, states, channels], the state before each chunk; may be null
  float* last_state = nullptr;  ///< [batch, states, channels], the state after the last token; may be null
};

/// dA and dD are one item's share each, in blocks of W channels: [batch, blocks, states, W] and [batch,
/// blocks, W].
struct ScanGradients {
  const float* dy = nullptr;            ///< [batch, length, channels]
  const float* chunk_states = nullptr;  ///< as the forward pass wrote them
  float *du = nullptr, *ddelta = nullptr,
        *dz = nullptr;                 ///< [batch, length, channels]; dz null without a gate
  float *dB = nullptr, *dC = nullptr;  ///< [batch, length, states]
  float *dA = nullptr, *dD = nullptr;
  const float* dlast_state = nullptr;  ///< [batch, states, channels] or null for zeros
  float* dh0 = nullptr;                ///< [batch, states, channels]; may be null
};

/// y[l] = silu(bias + sum_k weight[k] x[l - taps + 1 + k]), per channel; x before the first token is `tail`.
struct ConvInputs {
  std::int64_t batch = 0, length = 0, channels = 0, taps = 0;
  Rows x;                         ///< [batch * length, channels]
  const float* weight = nullptr;  ///< [taps, channels]
  const float* bias = nullptr;    ///< [channels]
  const float* tail = nullptr;    ///< [batch, taps - 1, channels] or null for zeros
};
inline constexpr int kMaxConvTaps = 8;

/// dweight and dbias are one item's share each: [batch, taps, channels] and [batch, channels].
struct ConvGradients {
  const float* dy = nullptr;  ///< [batch, length, channels]
  float *dx = nullptr, *dweight = nullptr, *dbias = nullptr;
  float* dtail = nullptr;  ///< [batch, taps - 1, channels]; may be null
};

/// y[r] (+)= W x[r] for every row r.
struct ProductArguments {
  std::int64_t rows = 0, inputs = 0, outputs = 0;
  Rows x;                         ///< [rows, inputs]
  const float* packed = nullptr;  ///< W as `pack` laid it out
  float* y = nullptr;             ///< [rows, outputs]
  std::int64_t y_stride = 0;
  bool add = false;  ///< onto what y holds
};

/// y = (x - mean) / sqrt(variance + epsilon) * gain + offset, over the channels of every row; y may be x.
struct NormArguments {
  std::int64_t rows = 0, channels = 0;
  const float* x = nullptr;                        ///< [rows, channels]
  const float *gain = nullptr, *offset = nullptr;  ///< [channels]
  float epsilon = 0;
  float* y = nullptr;  ///< [rows, channels]
};

/// One item (and, forward, a range of channel blocks) per call; calls for different items may run in
/// parallel.
struct MambaKernels {
  const char* name;
  int width;  ///< channels per block
  void (*scan_forward)(const ScanInputs&, const ScanOutputs&, std::int64_t item, std::int64_t first_block,
                       std::int64_t last_block);
  void (*scan_backward)(const ScanInputs&, const ScanGradients&, std::int64_t item, float* scratch);
  void (*conv_forward)(const ConvInputs&, float* y, std::int64_t item);
  void (*conv_backward)(const ConvInputs&, const ConvGradients&, std::int64_t item);
  /// W [outputs, inputs] row by row -> packed_floats(inputs, outputs) floats for `multiply`.
  void (*pack)(const float* weight, std::int64_t inputs, std::int64_t outputs, float* packed);
  void (*multiply)(const ProductArguments&);
  void (*layer_norm)(const NormArguments&);
  /// x [rows, channels] becomes log(1 + e^(x + bias)), bias [channels].
  void (*softplus)(float* x, const float* bias, std::int64_t rows, std::int64_t channels);
  std::int64_t blocks(std::int64_t channels) const { return (channels + width - 1) / width; }
  std::int64_t packed_floats(std::int64_t inputs, std::int64_t outputs) const {
    return inputs * blocks(outputs) * width;
  }
  /// Floats that scan_backward wants as scratch.
  std::int64_t scratch_floats(const ScanShape& shape) const;
};

extern const MambaKernels kPortableKernels, kAvx2Kernels, kAvx512Kernels;

/// Those that this machine can run, fastest first; never empty.
const std::vector<const MambaKernels*>& supported_mamba_kernels();

}  // namespace flowscope
