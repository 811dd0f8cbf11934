// Prepared scenes and noisy poses as tensors. All float32 on the CPU; S scenes, B = S * draws noisy poses,
// scene-major.
#pragma once

#include <vector>

#include "policy/region.h"
#include "policy/rotation6.h"
#include "policy/sample.h"
#include "policy/torch_parts.h"

namespace flowscope {

/// Numbers that describe one point: position to the workspace centre, to the tool in world and in tool axes,
/// normal in world and in tool axes, colour, height above the plane (coarse and fine), the middle of what it
/// belongs to as seen from it, how much that is and how square and long. A geometry point adds its place in
/// the sphere.
inline constexpr int point_features = 26, region_features = point_features + 8;
inline constexpr int history_features = 3 + 6 + 1 + 7;

/// What does not change along the flow.
struct SceneBatch {
  torch::Tensor word_row, word_mention;  ///< [S, W] int64; row 0 pads at the end
  torch::Tensor word_color;              ///< [S, W, 3]
  torch::Tensor word_feature;            ///< [S, W, F] of a frozen text encoder; undefined without one
  torch::Tensor image_feature;           ///< [S, M, point_features]
  torch::Tensor image_position;          ///< [S, M, 3] metres, world: the middle of what the point belongs to
  torch::Tensor image_moments;           ///< [S, M, 4] its square and bar moments
  torch::Tensor image_color;             ///< [S, M, 3]
  torch::Tensor patches;                 ///< [S, M, patch_values]
  torch::Tensor pictures;                ///< [S V, 3, H, W] RGB in [0, 1]; undefined without a frozen trunk
  torch::Tensor patch_place;             ///< [S, M, 3] view, x, y of each token in them
  torch::Tensor history;                 ///< [S, 3, history_features], oldest first
  torch::Tensor history_position;        ///< [S, 3, 3] metres, world
  torch::Tensor tool_axes;               ///< [S, 3, 3] rows: x, y, z axis of the tool now, world
  torch::Tensor keyframe_index;          ///< [S] int64
};

/// What changes with every step of the flow.
struct DrawBatch {
  torch::Tensor x;                ///< [B, 9] noisy pose, normalised
  torch::Tensor t;                ///< [B]
  torch::Tensor region_feature;   ///< [B, n, region_features]
  torch::Tensor region_position;  ///< [B, n, 3] metres, world: the middle of what the point belongs to
  torch::Tensor region_place;     ///< [B, n, 3] metres, world: the point itself
  torch::Tensor region_moments;   ///< [B, n, 4]
  torch::Tensor region_color;     ///< [B, n, 3]
};

struct Draw {
  Vector9 x{};
  double t = 0, radius_m = 0;
  bool everywhere = false;  ///< schedule "off"
};

SceneBatch make_scene_batch(const std::vector<const SceneInput*>& scenes, const NetworkShape& shape,
                            const PositionScale& scale);

/// `draws` holds draws_per_scene of each scene in turn. `regions`, when given, receives what was selected.
DrawBatch make_draw_batch(const std::vector<const SceneInput*>& scenes, const std::vector<Draw>& draws,
                          const NetworkShape& shape, const PositionScale& scale,
                          std::vector<RegionPoints>* regions = nullptr);

}  // namespace flowscope
