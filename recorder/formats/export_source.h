// What an export needs besides the demonstration: things that only the simulator or the renderer know.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "recorder/demo.h"

namespace flowscope {

/// Functions may be empty: what they would give is left out.
struct ExportSource {
  /// Pictures of any frame, every camera that the format shall have. The demonstration's own, where it has
  /// them: then an import finds them again.
  std::function<Observation(const Demo&, int frame)> observe;
  /// Everything in the state that is not the robot, as numbers.
  std::function<std::vector<double>(const SceneState&)> object_state;
  std::string model_xml;  ///< the compiled scene as MJCF
  std::string robot;      ///< its name
  /// Of a finger's joint, m (rad where it is a hinge).
  double finger_open = 0.04, finger_closed = 0;
  std::size_t joints = 7;  ///< of the arm, for files that do not say; what frames hold beyond is left out
  double finger(double openness) const { return finger_closed + openness * (finger_open - finger_closed); }
};

/// How many of a frame's joints the robot has.
inline std::size_t joints_of(const Demo& demo, const ExportSource& source) {
  return demo.info.origin.joints > 0 ? static_cast<std::size_t>(demo.info.origin.joints) : source.joints;
}

/// The demonstration's own pictures of a frame: there are some of the first and of every keyframe. Null
/// elsewhere.
inline const Observation* stored_observation(const Demo& demo, int frame) {
  if (frame == 0) return &demo.start;
  for (const Keyframe& keyframe : demo.keyframes) {
    if (keyframe.frame == frame) return &keyframe.observation;
  }
  return nullptr;
}

}  // namespace flowscope
