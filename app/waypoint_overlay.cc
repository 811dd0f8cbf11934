#include "app/waypoint_overlay.h"

#include <algorithm>

namespace flowscope {

namespace {
constexpr std::size_t most_drawn = 200;  // a script may have 10 000 steps; nobody could tell them apart
}

Overlay overlay_of_waypoints(const std::vector<PlacedStep>& steps, std::optional<int> selected) {
  Overlay overlay;
  const auto faded = [](Rgba color, float alpha) {
    color[3] = alpha;
    return color;
  };
  const PlacedMove* before = nullptr;
  for (std::size_t i = 0; i < std::min(steps.size(), most_drawn); ++i) {
    const PlacedStep& step = steps[i];
    const bool chosen = selected && *selected == static_cast<int>(i);
    if (step.move) {
      const Pose& pose = step.move->world_from_tool;
      overlay.frames.push_back({pose, chosen ? 0.07 : 0.04, 1});
      overlay.labels.push_back({pose.position, std::to_string(i + 1)});
      if (before && position_error_m(before->world_from_tool, pose) > 1e-4) {
        const bool linear = std::get<MoveStep>(step.step.what).linear;
        const Rgba color = faded(palette::expert, linear ? 1.0f : 0.45f);
        overlay.lines.push_back(
            {{before->world_from_tool.position, pose.position}, linear ? 0.004 : 0.003, color, color});
      }
      before = &*step.move;
    }
    if (chosen && before) {
      overlay.ghosts.push_back({before->world_from_tool, step.openness, faded(palette::expert, 0.45f)});
    }
  }
  return overlay;
}

}  // namespace flowscope
