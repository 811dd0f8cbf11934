// A demonstration as named arrays: what every export holds so that an import gives the same one back.
//
//   header                                      text: the demonstration file's JSON header (cameras, task, …)
//   frame/time_s (T)  frame/q (T,J)  frame/dq (T,J)  frame/openness (T)  frame/gripper_open (T)
//   frame/tool_position (T,3)  frame/tool_quaternion (T,4)        w,x,y,z
//   state/time_s (T)  state/qpos (T,nq)  …                        the simulator's state at every frame
//   keyframe/frame (K)  keyframe/position (K,3)  keyframe/quaternion (K,4)  keyframe/openness (K)
//   observation/<camera>_rgb (K+1,H,W,3)  _depth (K+1,H,W)        at frame 0, then at each keyframe; metres
//   observation/<camera>_intrinsics (K+1,3,3)  _extrinsics (K+1,4,4)   for readers; the header decides
//
// J: the arm's joints, 6 of a UR5; 7 where the header does not name the robot (older files).
// Metres, radians, seconds; extrinsics are world_from_camera with x right, y down, z forward; pixel centres
// at integer + 0.5.
#pragma once

#include <vector>

#include "recorder/demo.h"
#include "recorder/formats/named_array.h"

namespace flowscope {

enum class ArrayParts { all, without_pictures };

/// Throws std::invalid_argument naming the place when the demonstration cannot be stored (see encode_demo),
/// or when its keyframes do not all have the same cameras, with names of letters, digits, '_' and '-'.
std::vector<NamedArray> arrays_of(const Demo& demo, ArrayParts parts);

/// The inverse, bit for bit. Without pictures every view has its camera and black pictures of its size.
/// Throws what `fetch` throws, or std::runtime_error that begins with `place` (file and group) and names the
/// array.
Demo demo_from_arrays(const FetchArray& fetch, ArrayParts parts, const std::string& place);

/// Letters, digits, '_' and '-': may become part of a path inside a file or folder.
bool is_plain_name(const std::string& name);

Eigen::Matrix3d intrinsic_matrix(const CameraModel& camera);
Eigen::Matrix4d matrix_of(const Pose& pose);

}  // namespace flowscope
