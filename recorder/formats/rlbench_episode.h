// RLBench's folder layout, as its own reader and the ones built on it (PerAct, 3D Diffuser Actor) take it:
//
//   <root>/<task>/variation<K>/episodes/episode<N>/     or all_variations/ instead of variation<K>/
//     front_rgb/<i>.png, front_depth/<i>.png, …   rlbench_camera.h says how depth is packed
//     low_dim_obs.pkl                             a Demo of Observations, both RLBench's classes
//     variation_number.pkl
//     variation_descriptions.pkl
//     flowscope.npz                               demo_arrays.h without pictures: what an import reads
//
// Poses in the pickle are x, y, z, qx, qy, qz, qw; misc has <camera>_camera_extrinsics, _intrinsics, _near
// and _far of each frame. What our simulation has not is None there: forces, masks, random_seed.
// ignore_collisions, which is not recorded, is always 1. joint_positions and joint_velocities have as many
// numbers as the arm has joints, which RLBench's readers take as they come (its own arms have 6 or 7);
// gripper_joint_positions are the first finger's, twice: metres, rad where it is a hinge. A scene of one
// camera has only that one's folders: readers must ask for no other.
#pragma once

#include <filesystem>
#include <vector>

#include "recorder/formats/export_source.h"

namespace flowscope {

struct RlbenchOptions {
  bool all_frames = true;       ///< else the first frame and the keyframes: a much shorter episode
  bool all_variations = false;  ///< the folder of that name instead of one for each variation
};

/// Adds an episode to the dataset under the next free number and returns its folder, which appears when it is
/// whole. Throws std::invalid_argument when the demonstration cannot be written (a name that is no folder's,
/// no one to take the pictures of all frames), std::runtime_error or std::system_error naming the path.
std::filesystem::path write_rlbench_episode(const std::filesystem::path& root, const Demo& demo,
                                            const ExportSource& source, const RlbenchOptions& options);

/// Every episode folder under `root` (which may be one itself), in order of task, variation and number.
/// Throws std::runtime_error naming the first one that write_rlbench_episode did not write.
std::vector<std::filesystem::path> find_rlbench_episodes(const std::filesystem::path& root);

/// Pictures and depth come from the PNG files. Throws std::runtime_error naming the file and the place.
Demo read_rlbench_episode(const std::filesystem::path& episode);

}  // namespace flowscope
