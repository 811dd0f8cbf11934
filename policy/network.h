// FlowRAM's network: encoders, state space fusion and velocity network (paper §3.3, §3.4).
#pragma once

#include "policy/backbone.h"
#include "policy/batch.h"
#include "policy/clip/image_branch.h"
#include "policy/grounding.h"
#include "policy/mlp.h"
#include "policy/point_encoder.h"
#include "policy/point_tokens.h"
#include "policy/torch_parts.h"

namespace flowscope {

/// Everything that one observation contributes, computed once per observation and kept along the flow.
struct SceneMemory {
  torch::Tensor words;  ///< [S, W, C]
  WordKeys region_words;
  torch::Tensor image, image_raw;  ///< [S, M, C] after and before fusion
  torch::Tensor history,
      history_raw;  ///< [S, 3, C] the same; carried: takes the prefix to the region's sequence
  BackboneState fusion_state, velocity_state;  ///< stored: what each block remembers of the prefix
  torch::Tensor condition;                     ///< [S, C] proprioception, keyframe index and instruction
  torch::Tensor sought;                        ///< [S, H, W] the word that each head looks for
  GroundingImpl::Points image_points, history_points;  ///< S rows; paper, carried: tokens change with a draw
  torch::Tensor image_position, history_position, tool_axes;
};

struct NetworkOutput {
  torch::Tensor action;      ///< [B, 9] grounded: predicted end point x1; else the velocity. Normalised
  torch::Tensor open_logit;  ///< [B]
  torch::Tensor
      weights;  ///< [B, n + M + 3] of geometric, image and history tokens; undefined for the plain form
  torch::Tensor weight_position;  ///< [B, n + M + 3, 3] metres, world: the places that they weigh
};

/// F_in is one sequence whose action token is last, so that a causal scan lets it see everything. Its order:
/// - paper (shape.paper_order): [geometry, image, instruction, history, pose], all of it at every flow step;
/// - stored (shape.stored_state): [instruction, image, history | geometry, pose]. The part before the bar
/// does
///   not change along the flow and goes through every block once; a step runs on from each block's state;
/// - carried (neither): the part before the bar has blocks of its own (prefix_blocks), and its history tokens
///   alone stand before the geometry. Cheapest, for small presets.
class FlowRamNetworkImpl : public torch::nn::Module {
 public:
  /// `trunk`: of the image branch "clip", which needs it. Throws std::invalid_argument for an unknown branch.
  FlowRamNetworkImpl(const NetworkShape& shape, const std::string& backbone,
                     std::shared_ptr<const ClipResNet> trunk = nullptr);
  const std::shared_ptr<const ClipResNet>& trunk() const { return trunk_; }
  SceneMemory encode(const SceneBatch& scenes);
  /// B must be a multiple of S; draws are scene-major.
  NetworkOutput forward(const SceneMemory& memory, const DrawBatch& draws, const PositionScale& scale);
  /// For comparisons: how the blocks compute, and whether every flow step runs the prefix again, as if no
  /// state were stored.
  void compute_by(ScanPath path, bool recompute_prefix);

 private:
  /// Tokens behind all blocks.
  struct Fused {
    torch::Tensor region, image, history, action;  ///< [B, n, C], [B, M, C], [B, 3, C], [B, C]
  };
  /// The geometric tokens before fusion and what the grounded form needs of each.
  struct Geometry {
    torch::Tensor token, raw;                  ///< [B, n, C] behind and before the point encoder
    torch::Tensor position, places, mismatch;  ///< [B, n, 3], [B, n, 10], [B, n, W]
  };
  BoundTokens bind_region(const SceneMemory& memory, const DrawBatch& draws);
  Geometry encode_points(const BoundTokens& bound, const DrawBatch& draws);
  void run_prefix(SceneMemory& memory);
  std::vector<GroundingImpl::Points> points_of(const SceneMemory& memory, const Fused& fused,
                                               const Geometry& geometry, std::int64_t draws);
  Fused fuse(const SceneMemory& memory, const torch::Tensor& region, const torch::Tensor& pose,
             const torch::Tensor& condition, std::int64_t draws);
  torch::Tensor time_embedding(const torch::Tensor& t);

  /// Semantic features of the image tokens, [S, M, C].
  torch::Tensor look(const SceneBatch& scenes);

  NetworkShape shape_;
  std::shared_ptr<const ClipResNet> trunk_;
  torch::nn::Embedding word_table_{nullptr}, mention_table_{nullptr}, place_table_{nullptr},
      keyframe_table_{nullptr};
  torch::nn::Linear word_color_{nullptr}, word_feature_{nullptr};
  ClipImageBranch clip_image_{nullptr};
  Mlp history_{nullptr}, proprioception_{nullptr}, time_{nullptr}, patch_{nullptr}, pose_{nullptr},
      instruction_{nullptr};
  PointTokens image_tokens_{nullptr}, region_tokens_{nullptr};
  Backbone prefix_{nullptr}, point_encoder_{nullptr}, fusion_{nullptr}, velocity_{nullptr};
  torch::nn::LayerNorm out_norm_{nullptr};
  PointEncoder groups_{nullptr};  ///< instead of point_encoder_ where the shape asks for groups
  Grounding grounding_{nullptr};
  Mlp plain_velocity_{nullptr}, open_{nullptr};
  bool recompute_prefix_ = false;
};
TORCH_MODULE(FlowRamNetwork);

}  // namespace flowscope
