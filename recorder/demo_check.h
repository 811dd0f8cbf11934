// Is a demonstration that could be read also one that can be learnt from?
#pragma once

#include <map>
#include <string>

#include "recorder/demo.h"

namespace flowscope {

/// How far a keyframe may lie outside a demonstration's box: the normaliser still copes with less.
inline constexpr double most_outside_m = 0.05;

/// The first thing that is wrong, with its place; empty when nothing is: times and keyframes ascend, the last
/// keyframe is the last frame, rotations are unit quaternions, numbers are finite, joints travel as far as
/// their recorded speeds take them, keyframes lie in (or hardly outside) the task's box, every picture shows
/// something, the instruction has a word.
std::string find_incoherence(const Demo& demo);

/// The one rule of what may lie in a store and be learnt from: each by itself, and no motion twice.
class DemoJudge {
 public:
  /// What is wrong with one more, states and all: find_incoherence's answer, or that one before holds the
  /// same states. Empty when nothing is: it counts from now on.
  std::string find_problem(const std::string& id, const Demo& demo);
  /// It is there no more.
  void forget(const std::string& id);

 private:
  std::map<std::string, std::string> by_motion_;  ///< fingerprint to the first id that has it
};

}  // namespace flowscope
