// One observation, prepared once: candidate points in the order in which the network may take them, and the
// places and patches of the semantic tokens.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "policy/preset.h"
#include "policy/surroundings.h"
#include "render/observation.h"

namespace flowscope {

/// Position in metres (world), colour in [0, 1], unit normal (world, towards the camera); and what the point
/// belongs to.
struct ScenePoint {
  Eigen::Vector3f position, color, normal;
  Surroundings around;
};

/// Pixels of one patch: 8 x 8 every second pixel around a point's own pixel, RGB in [0, 1].
inline constexpr int patch_side = 8, patch_values = patch_side * patch_side * 3;
using Patch = std::array<float, patch_values>;

/// Points are in farthest-point order (position and colour) at the front and in a fixed shuffled order
/// behind, so the first n of them that lie inside any sphere cover it evenly. The first points with
/// a patch are the places of the semantic tokens; as many again have one for when training leaves some out.
struct PreparedScene {
  std::vector<ScenePoint> points;
  std::vector<Patch> patches;
  std::vector<Eigen::Vector3f>
      patch_place;  ///< view, x, y of each patch's middle; pixel centres at integer + 0.5
  std::shared_ptr<const std::vector<ImageRgb>>
      pictures;            ///< of the views, where a frozen trunk looks at them
  std::vector<int> thing;  ///< of each point (find_things); -1 for the plane
  std::vector<int> part;   ///< like-coloured part of a thing (find_parts); -1 for none
  float plane_z = 0;       ///< height of the dominant horizontal plane, metres, world
};

/// Where each pixel of each view stands, metres, world: [view][y * width + x]; (0, 0, 0) without a depth.
using PixelPlaces = std::vector<std::vector<Eigen::Vector3d>>;

/// Cloud from RGB-D inside `bounds` widened to the workspace; fine grid of `shape.voxel_m` on things, coarse
/// grid on the dominant plane (voxel_m 0: every pixel); deterministic. 65 536 pixels take tens of ms. Throws
/// std::invalid_argument when views are missing, of odd sizes, or no point is inside. `places` tells of
/// pictures whose pixels no longer stand where their cameras say (picture_crop.h).
PreparedScene prepare_scene(const Observation& observation, const Box& bounds, const NetworkShape& shape,
                            const PixelPlaces* places = nullptr);

/// The task's keyframe box widened so that what the keyframes stand on and belong to is seen.
Box workspace_of(const Box& bounds);

}  // namespace flowscope
