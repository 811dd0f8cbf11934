// Is a demonstration that could be read also one that can be learnt from?
#pragma once

#include <string>

#include "recorder/demo.h"

namespace flowscope {

/// The first thing that is wrong, with its place; empty when nothing is: times and keyframes ascend, the last
/// keyframe is the last frame, rotations are unit quaternions, numbers are finite, joints travel as far as
/// their recorded speeds take them, keyframes lie in (or hardly outside) the task's box, every picture shows
/// something.
std::string find_incoherence(const Demo& demo);

}  // namespace flowscope
