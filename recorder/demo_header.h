// The JSON header of a demonstration file: what is known about it before its blocks are read.
//
//   task, variation, seed, created, simulator, frames, instructions, bounds {min, max}
//   robot {name, joints}          name of its description and number of its arm's joints
//   scene {file, robot, folder,   only in a user's own scene: files as given to --scene and --robot, the
//          sha256, robot_sha256,  folder where relative ones lie; fingerprints of the compiled scene and of
//          key}                   the description; the key frame that was named (demo_origin.h)
//   success                       whether the task's condition has held; left out where it has none
//   state {scene, qpos, …}        numbers of values in each part of a state; states_bytes: their block
//   keyframes                     indices of frames
//   observations                  for the start and each keyframe: views with camera, size, lengths of blocks
//
// Files of older builds have no robot, scene and success: then these are not known.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "recorder/demo.h"

namespace flowscope {

/// How one picture pair lies in the file.
struct ViewLayout {
  CameraModel camera;
  double depth_unit_m = 1e-4;                    ///< metres per count of the stored 16-bit depth
  std::uint64_t rgb_bytes = 0, depth_bytes = 0;  ///< compressed
};

/// Numbers of values in each part of every frame's SceneState.
struct StateLayout {
  std::string scene;
  std::uint64_t qpos = 0, qvel = 0, act = 0, ctrl = 0, qacc_warmstart = 0;
  std::uint64_t mocap_pos = 0, mocap_quat = 0, eq_active = 0, eq_data = 0, mat_rgba = 0;
  bool operator==(const StateLayout&) const = default;
  std::uint64_t bytes() const;  ///< of one packed state, its time included
};

struct DemoHeader {
  DemoInfo info;  ///< id and bytes are the file's own and not part of the header
  std::string simulator;
  std::vector<std::string> instructions;
  Box bounds;
  StateLayout state;
  std::uint64_t states_bytes = 0;                     ///< compressed
  std::vector<int> keyframes;                         ///< frame indices
  std::vector<std::vector<ViewLayout>> observations;  ///< the start's, then each keyframe's
};

std::string to_json_text(const DemoHeader& header);
/// A camera with the header's keys: enough to turn depth into points (see CameraModel). Pixels, metres, and
/// the quaternion of world_from_camera as w, x, y, z.
std::string to_json_text(const CameraModel& camera);

/// Throws std::runtime_error naming the key. Everything is checked against caps, so that sizes may be
/// trusted.
DemoHeader parse_demo_header(const std::string& text);

}  // namespace flowscope
