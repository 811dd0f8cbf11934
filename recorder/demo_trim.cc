#include "recorder/demo_trim.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace flowscope {
namespace {

constexpr double kSamePlace = 1e-3;  ///< m or rad
constexpr double kSlow = 0.02;       ///< m/s or rad/s: at the end, nothing may only pass by its last place

bool same_place(const Frame& a, const Frame& b) {
  const SceneState &s = a.state, &t = b.state;
  if (a.gripper_open != b.gripper_open || s.eq_active != t.eq_active || s.mocap_pos != t.mocap_pos ||
      s.qpos.size() != t.qpos.size()) {
    return false;
  }
  return std::equal(s.qpos.begin(), s.qpos.end(), t.qpos.begin(),
                    [](double p, double q) { return std::abs(p - q) <= kSamePlace; });
}

bool slow(const Frame& frame) {
  return std::all_of(frame.state.qvel.begin(), frame.state.qvel.end(),
                     [](double v) { return std::abs(v) <= kSlow; });
}

}  // namespace

FrameSpan busy_span(const Demo& demo) {
  const std::vector<Frame>& frames = demo.frames;
  const int end = static_cast<int>(frames.size()) - 1;
  FrameSpan span{0, end};
  // Frame 0 is no keyframe, so one frame before the first keyframe stays; and one after the last but one.
  const int latest = demo.keyframes.empty() ? end - 1 : demo.keyframes.front().frame - 1;
  while (span.first < latest && same_place(frames[span.first + 1], frames[0])) ++span.first;
  int earliest = span.first + 1;
  if (demo.keyframes.size() > 1) earliest = demo.keyframes[demo.keyframes.size() - 2].frame + 1;
  while (span.last > earliest && same_place(frames[span.last - 1], frames[end]) &&
         slow(frames[span.last - 1])) {
    --span.last;
  }
  return span;
}

Demo trimmed(const Demo& demo, const FrameSpan& span, const Observe& observe) {
  const int count = static_cast<int>(demo.frames.size());
  if (span.first < 0 || span.last >= count || span.first >= span.last) {
    throw std::invalid_argument("nothing would be left of the demonstration");
  }
  Demo cut = demo;
  cut.frames.assign(demo.frames.begin() + span.first, demo.frames.begin() + span.last + 1);
  for (std::size_t k = 0; k < cut.keyframes.size(); ++k) {
    Keyframe& keyframe = cut.keyframes[k];
    const bool last = k + 1 == cut.keyframes.size();
    if (last && keyframe.frame > span.last) {
      const Frame& frame = demo.frames[span.last];
      keyframe.frame = span.last;
      keyframe.action.world_from_tool = frame.world_from_tool;
      keyframe.observation = observe(frame.state);
    }
    if (keyframe.frame <= span.first || keyframe.frame > span.last) {
      throw std::invalid_argument("keyframe " + std::to_string(k) + " would be cut");
    }
    keyframe.frame -= span.first;
  }
  if (span.first > 0) cut.start = observe(cut.frames.front().state);
  cut.info.frames = static_cast<int>(cut.frames.size());
  return cut;
}

}  // namespace flowscope
