// What a store's demonstrations have in common, task by task.
#pragma once

#include <algorithm>
#include <limits>
#include <map>
#include <string>

#include "recorder/demo.h"

namespace flowscope {

/// Of a quantity that every demonstration, or every frame, has one of.
struct Spread {
  int count = 0;
  double sum = 0, min = std::numeric_limits<double>::infinity(), max = -min;
  void add(double value) {
    ++count;
    sum += value;
    min = std::min(min, value);
    max = std::max(max, value);
  }
  double mean() const { return count > 0 ? sum / count : 0; }
};

struct TaskStats {
  int demos = 0, unfinished = 0;
  std::map<int, int> by_variation;  ///< variation to number of demonstrations
  Spread frames, keyframes, seconds;
  Spread gripper_events;       ///< openings and closings of a demonstration
  Spread tool_speed_m_s;       ///< between neighbouring frames
  double max_joint_speed = 0;  ///< rad/s, of any joint
  Box tool_extent, bounds;     ///< of the tool over all frames; the task's box; metres, world
  int keyframes_outside = 0;   ///< outside the task's box, by however little
  std::uint64_t bytes = 0;

  /// Needs no states.
  void add(const Demo& demo);
};

}  // namespace flowscope
