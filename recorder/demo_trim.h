// Cutting what comes before the first and after the last motion.
#pragma once

#include "recorder/demo.h"
#include "recorder/record.h"

namespace flowscope {

/// The frames of a demonstration that stay, first and last included.
struct FrameSpan {
  int first = 0, last = 0;
  bool operator==(const FrameSpan&) const = default;
};

/// From the last frame of the idle start to the first frame of the idle end. Idle: arm, fingers and objects
/// stay within a milliradian or millimetre of where they begin (end), and the gripper does not change. Every
/// keyframe but the last stays where it is; the last moves to the new last frame.
FrameSpan busy_span(const Demo& demo);

/// `demo` without the frames outside `span`; times and states stay as recorded. `observe` photographs the
/// first and the last frame anew where they changed. Throws std::invalid_argument when a keyframe other than
/// the last would be cut.
Demo trimmed(const Demo& demo, const FrameSpan& span, const Observe& observe);

}  // namespace flowscope
