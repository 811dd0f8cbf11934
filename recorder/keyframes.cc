#include "recorder/keyframes.h"

#include <algorithm>
#include <cmath>

namespace flowscope {
namespace {

constexpr double still_rad_s = 0.1;  // absolute, every joint
constexpr int frames_between_stops = 4;
constexpr double same_action_m = 0.004, same_action_rad = 0.02;

bool arm_still(const Frame& frame) {
  return std::all_of(frame.dq.begin(), frame.dq.end(), [](double dq) { return std::abs(dq) <= still_rad_s; });
}

/// Same opening at i-2, i-1, i and i+1; never true for the last two frames.
bool gripper_unchanged(const std::vector<Frame>& frames, int i) {
  if (i >= static_cast<int>(frames.size()) - 2) return false;
  const bool open = frames[i].gripper_open;
  return frames[i + 1].gripper_open == open && frames[std::max(i - 1, 0)].gripper_open == open &&
         frames[std::max(i - 2, 0)].gripper_open == open;
}

bool same_action(const Frame& a, const Frame& b) {
  return position_error_m(a.world_from_tool, b.world_from_tool) < same_action_m &&
         rotation_error_rad(a.world_from_tool, b.world_from_tool) < same_action_rad &&
         a.gripper_open == b.gripper_open;
}

}  // namespace

std::vector<int> find_keyframes(const std::vector<Frame>& frames) {
  std::vector<int> keyframes;
  const int count = static_cast<int>(frames.size());
  int wait = 0;
  for (int i = 0; i < count; ++i) {
    const bool stopped = wait <= 0 && arm_still(frames[i]) && gripper_unchanged(frames, i);
    wait = stopped ? frames_between_stops : wait - 1;
    const bool last = i == count - 1;
    if (i > 0 && (last || stopped || frames[i].gripper_open != frames[i - 1].gripper_open)) {
      keyframes.push_back(i);
    }
  }
  const std::size_t n = keyframes.size();
  if (n > 1 && keyframes[n - 2] == keyframes[n - 1] - 1) keyframes.erase(keyframes.end() - 2);
  return keyframes;
}

std::vector<int> keyframes_to_learn(const std::vector<Frame>& frames) {
  std::vector<int> keyframes = find_keyframes(frames);
  for (std::size_t i = 1; i + 1 < keyframes.size();) {
    const Frame& next = frames[keyframes[i + 1]];
    const bool waits =
        same_action(frames[keyframes[i - 1]], frames[keyframes[i]]) &&
        next.gripper_open != frames[keyframes[i]].gripper_open &&
        std::all_of(frames.begin() + keyframes[i - 1], frames.begin() + keyframes[i + 1], arm_still);
    if (waits) {
      keyframes.erase(keyframes.begin() + static_cast<std::ptrdiff_t>(i));
    } else {
      ++i;
    }
  }
  if (keyframes.size() < 2) return keyframes;
  if (same_action(frames[keyframes[keyframes.size() - 2]], frames[keyframes.back()])) {
    keyframes.erase(keyframes.end() - 2);
  }
  return keyframes;
}

}  // namespace flowscope
