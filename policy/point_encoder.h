// Point encoder after PointMamba (arXiv:2402.10739): points become groups, groups a sequence that is read
// along two curves, so that a scan which sees only what came before sees every group from both sides.
#pragma once

#include <string>

#include "policy/backbone.h"
#include "policy/mlp.h"
#include "policy/preset.h"
#include "policy/torch_parts.h"

namespace flowscope {

struct GroupTokens {
  torch::Tensor token;   ///< [B, 2 G, C] along the Hilbert curve, then along the transposed one
  torch::Tensor center;  ///< [B, 2 G] int64, which of the n points stands in the middle of each token's group
};

/// A group's token: its k points j around centre i as h_j = gelu(A token_j + P (x_j - x_i) / r), u_j = gelu(B
/// h_j + D max h), then E max u, r the mean reach of the groups; plus an MLP of the centre's place. A and D
/// are applied before points are repeated in groups: (n + (k + 2) G) C² multiplications in all, and 0.15 G at
/// n = 1024, G = 512, k = 16, C = 120. Indices are found on the CPU, outside autograd, and are the same each
/// time.
class PointEncoderImpl : public torch::nn::Module {
 public:
  /// Of `shape`: channels, d_state, point_blocks, point_groups, group_size. Throws std::invalid_argument for
  /// no groups.
  PointEncoderImpl(const NetworkShape& shape, const std::string& backbone);
  /// tokens [B, n, C], already bound to words; position [B, n, 3] metres, world. Throws std::invalid_argument
  /// for other shapes and for fewer points than groups or than a group's size.
  GroupTokens forward(const torch::Tensor& tokens, const torch::Tensor& position);
  /// As Backbone's; `fused` covers the groups too (policy/fused_groups.h).
  void run_by(ScanPath path) {
    path_ = path;
    place_->run_by(path);
    blocks_->run_by(path);
  }

 private:
  void require_fitting(const torch::Tensor& tokens, const torch::Tensor& position) const;
  torch::Tensor embed_groups(const torch::Tensor& tokens, const torch::Tensor& relative,
                             const torch::Tensor& neighbour);

  int channels_, groups_, size_;
  ScanPath path_ = ScanPath::fused;
  torch::nn::Linear token_in_{nullptr}, place_in_{nullptr}, inner_{nullptr}, pooled_{nullptr}, out_{nullptr};
  Mlp place_{nullptr};
  torch::Tensor scale_, shift_;  ///< [2, C] tell the two readings apart
  Backbone blocks_{nullptr};
};
TORCH_MODULE(PointEncoder);

}  // namespace flowscope
