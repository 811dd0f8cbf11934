// A demonstration as a value: what the recorder writes, the store keeps and the policy learns from.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "recorder/demo_origin.h"
#include "render/observation.h"
#include "render/scene_state.h"

namespace flowscope {

/// Where the tool shall be and how open its fingers. Openness: 1 open, 0 closed.
struct GripperAction {
  Pose world_from_tool;
  double openness = 1;
  bool open() const { return openness > 0.5; }
  bool operator==(const GripperAction&) const = default;
};

/// One record at 20 Hz.
struct Frame {
  double time_s = 0;
  std::array<double, 7> q{},
      dq{};                  ///< arm joints, rad and rad/s, as the simulator has them (never differenced)
  double openness = 1;       ///< finger opening / full opening
  bool gripper_open = true;  ///< openness > 0.95, the benchmark's rule
  Pose world_from_tool;
  SceneState state;
};

/// A keyframe: the action reached at frame `frame`. Its observation is the picture taken there.
struct Keyframe {
  int frame = 0;
  GripperAction action;
  Observation observation;  ///< four cameras, 128x128, taken at `frame`
};

struct DemoInfo {
  std::string id;  ///< [A-Za-z0-9_-]{1,64}
  std::string task;
  int variation = 0;
  std::uint64_t seed = 0;
  std::string instruction;
  std::string created;  ///< ISO 8601, UTC
  int frames = 0, keyframes = 0;
  std::uint64_t bytes = 0;  ///< of the file
  DemoOrigin origin;
  /// Whether the task's condition has held; none: there is no condition, or the file does not say.
  std::optional<bool> success;
  bool unfinished() const { return success == false; }
};

/// To predict keyframe k (0-based) the policy sees `start` for k = 0 and keyframes[k-1].observation after
/// that.
struct Demo {
  DemoInfo info;
  std::vector<std::string> instructions;  ///< all phrasings of this variation; the first is info.instruction
  Box bounds;  ///< metres, world: the task's, widened to keyframes far outside; normalises
  std::vector<Frame> frames;
  Observation start;  ///< taken at frame 0
  std::vector<Keyframe> keyframes;
  std::string simulator;  ///< name and version of the physics that made the states
};

/// The robot's part of a policy input.
struct RobotState {
  Pose world_from_tool;
  double openness = 1;
  std::array<double, 7> q{};
};

}  // namespace flowscope
