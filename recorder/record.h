// One scripted run: a demonstration if it succeeds, a reason if it does not.
#pragma once

#include <functional>
#include <optional>
#include <stop_token>
#include <string>

#include "recorder/demo.h"
#include "recorder/motion/motion.h"
#include "recorder/term_series.h"

namespace flowscope {

/// Takes the 128x128 pictures of a state; the caller provides it because only one thread may own a
/// renderer.
using Observe = std::function<Observation(const SceneState&)>;

struct RunReport {
  bool success = false;
  std::optional<Demo> demo;             ///< set when success and there was someone to take the pictures
  int step = -1;                        ///< index of the failing script step
  int line = 0;                         ///< its line in the script
  std::optional<Pose> world_from_tool;  ///< what the failing step was to reach, when it is a move
  std::string reason;  ///< empty when success; names waypoint, cause, and the success terms that are false
  std::vector<TermSeries> terms;  ///< whether it succeeded or not
  double sim_seconds = 0, wall_seconds = 0;
};

/// The cameras of a policy's observation, in order: those of front, left_shoulder, right_shoulder and wrist
/// that the scene has; a scene with none of these is seen through all its own.
std::vector<std::string> observation_cameras(const mjModel_* model);
inline constexpr int observation_size = 128;  ///< pixels

/// A demonstration of the world's episode from the frames since its reset; `keyframes` are indices of them,
/// in order, and are photographed.
Demo make_demo(const World& world, std::vector<Frame> frames, const std::vector<int>& keyframes,
               const Observe& observe);

/// Runs `script` from the world's present state (reset before), ends after the step that succeeded like the
/// benchmark does, finds the keyframes and has them photographed. `on_frame` sees every frame (live view);
/// may be empty.
RunReport run_script(World& world, const Script& script, const Observe& observe,
                     const std::function<void(const Frame&)>& on_frame = {}, std::stop_token stop = {});

}  // namespace flowscope
