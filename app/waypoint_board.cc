#include "app/waypoint_board.h"

#include <algorithm>

namespace flowscope {
namespace {

bool same_place(const PlacedStep& a, const PlacedStep& b) {
  constexpr double apart_m = 5e-4, apart_rad = 5e-3;
  if (a.move.has_value() != b.move.has_value()) return false;
  if (!a.move) return true;
  return position_error_m(a.move->world_from_tool, b.move->world_from_tool) < apart_m &&
         rotation_error_rad(a.move->world_from_tool, b.move->world_from_tool) < apart_rad;
}

}  // namespace

std::vector<PlacedStep> WaypointBoard::place(const SimSnapshot& scene, ScratchWorld& scratch) const {
  if (!script_) return {};
  return scratch.at(scene.state, [&](const World& world) {
    return place_script(world, *script_, start_.world_from_tool, start_.openness);
  });
}

std::vector<PlacedStep> WaypointBoard::set(std::optional<Script> script, std::optional<int> selected,
                                           const SimSnapshot& scene, ScratchWorld& scratch) {
  std::lock_guard lock(mutex_);
  script_ = std::move(script);
  selected_ = selected;
  start_ = scene.robot;
  episode_ = scene.episode;
  steps_ = place(scene, scratch);
  return steps_;
}

bool WaypointBoard::follow(const SimSnapshot& scene, ScratchWorld& scratch) {
  std::lock_guard lock(mutex_);
  if (!script_) return false;
  if (scene.episode != episode_) {
    start_ = scene.robot;
    episode_ = scene.episode;
  }
  auto steps = place(scene, scratch);
  if (std::ranges::equal(steps, steps_, same_place)) return false;
  steps_ = std::move(steps);
  return true;
}

std::vector<PlacedStep> WaypointBoard::steps() const {
  std::lock_guard lock(mutex_);
  return steps_;
}

std::optional<int> WaypointBoard::selected() const {
  std::lock_guard lock(mutex_);
  return selected_;
}

}  // namespace flowscope
