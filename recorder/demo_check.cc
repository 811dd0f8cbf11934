#include "recorder/demo_check.h"

#include <algorithm>
#include <cmath>

namespace flowscope {
namespace {

bool usable(const Pose& pose) {
  return pose.position.allFinite() && std::abs(pose.rotation.norm() - 1) < 1e-6;
}

/// One colour all over: the renderer did not draw.
bool is_constant(const ImageRgb& image) {
  for (std::size_t i = 3; i < image.data.size(); ++i) {
    if (image.data[i] != image.data[i - 3]) return false;
  }
  return true;
}

std::string find_bad_picture(const Observation& observation, const std::string& place) {
  if (observation.views.empty()) return place + " has no picture";
  for (const View& view : observation.views) {
    const std::string where = place + ", view " + view.camera.name;
    if (view.rgb.data.empty() || is_constant(view.rgb)) return where + ": the picture has one colour";
    if (std::none_of(view.depth.data.begin(), view.depth.data.end(), [](float z) { return z > 0; })) {
      return where + ": no pixel has a depth";
    }
  }
  return {};
}

std::string find_bad_frame(const std::vector<Frame>& frames) {
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const std::string place = "frame " + std::to_string(i);
    if (i > 0 && !(frames[i].time_s > frames[i - 1].time_s)) return place + ": time does not advance";
    if (!usable(frames[i].world_from_tool)) return place + ": the tool pose is not one";
    const auto is_finite = [](double value) { return std::isfinite(value); };
    if (!std::all_of(frames[i].q.begin(), frames[i].q.end(), is_finite) ||
        !std::all_of(frames[i].dq.begin(), frames[i].dq.end(), is_finite)) {
      return place + ": a joint value is not finite";
    }
  }
  return {};
}

std::string find_bad_keyframe(const Demo& demo) {
  int previous = 0;
  for (std::size_t k = 0; k < demo.keyframes.size(); ++k) {
    const Keyframe& keyframe = demo.keyframes[k];
    const std::string place = "keyframe " + std::to_string(k);
    if (keyframe.frame <= previous || keyframe.frame >= static_cast<int>(demo.frames.size())) {
      return place + ": frame " + std::to_string(keyframe.frame) + " is out of order";
    }
    previous = keyframe.frame;
    const GripperAction& action = keyframe.action;
    if (!usable(action.world_from_tool) || !(action.openness >= 0 && action.openness <= 1)) {
      return place + ": the action is not one";
    }
    if (std::string problem = find_bad_picture(keyframe.observation, place); !problem.empty()) return problem;
  }
  if (previous != static_cast<int>(demo.frames.size()) - 1) return "the last keyframe is not the last frame";
  return {};
}

}  // namespace

std::string find_incoherence(const Demo& demo) {
  if (demo.frames.size() < 2) return "fewer than two frames";
  if (demo.keyframes.empty()) return "no keyframe";
  if (demo.info.task.empty()) return "no task";
  if (demo.info.instruction.empty()) return "no instruction";
  if (!(demo.bounds.min.array() < demo.bounds.max.array()).all()) return "the bounds are not a box";
  if (std::string problem = find_bad_frame(demo.frames); !problem.empty()) return problem;
  if (std::string problem = find_bad_picture(demo.start, "start"); !problem.empty()) return problem;
  return find_bad_keyframe(demo);
}

}  // namespace flowscope
