#include "recorder/hand_keyframes.h"

#include <algorithm>
#include <iterator>

#include "recorder/keyframes.h"

namespace flowscope {
namespace {

bool gripper_changes_at(const std::vector<Frame>& frames, int i) {
  return frames[i].gripper_open != frames[i - 1].gripper_open;
}

bool same_place(const Frame& a, const Frame& b) {
  return position_error_m(a.world_from_tool, b.world_from_tool) < hand_same_m &&
         rotation_error_rad(a.world_from_tool, b.world_from_tool) < hand_same_rad;
}

/// All that may count, ascending.
std::vector<int> candidates(const std::vector<Frame>& frames, const std::vector<char>& by_hand,
                            const std::vector<int>& rests) {
  const int last = static_cast<int>(frames.size()) - 1;
  std::vector<int> stops;
  for (const int i : find_keyframes(frames)) {
    if (!by_hand[i]) stops.push_back(i);
  }
  for (int i = 1; i <= last; ++i) {
    if (by_hand[i] && (i == last || !by_hand[i + 1] || gripper_changes_at(frames, i))) stops.push_back(i);
  }
  std::copy_if(rests.begin(), rests.end(), std::back_inserter(stops), [](int i) { return i > 0; });
  std::sort(stops.begin(), stops.end());
  stops.erase(std::unique(stops.begin(), stops.end()), stops.end());
  return stops;
}

}  // namespace

std::vector<int> hand_keyframes(const std::vector<Frame>& frames, const std::vector<char>& by_hand,
                                const std::vector<int>& rests) {
  struct Stop {
    int frame;
    bool gripper_changes;
  };
  std::vector<Stop> kept;
  for (const int i : candidates(frames, by_hand, rests)) {
    Stop stop{i, gripper_changes_at(frames, i)};
    if (!kept.empty() && (by_hand[i] || by_hand[kept.back().frame]) &&
        !(kept.back().gripper_changes && stop.gripper_changes) &&
        same_place(frames[kept.back().frame], frames[i])) {
      stop.gripper_changes = stop.gripper_changes || kept.back().gripper_changes;
      kept.pop_back();
    }
    kept.push_back(stop);
  }
  std::vector<int> keyframes;
  for (const Stop& stop : kept) keyframes.push_back(stop.frame);
  return keyframes;
}

}  // namespace flowscope
