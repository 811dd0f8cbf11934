// The script whose waypoints are drawn over the views.
#pragma once

#include <mutex>
#include <optional>
#include <vector>

#include "app/scratch_world.h"
#include "app/sim_loop.h"
#include "recorder/script_poses.h"

namespace flowscope {

/// Keeps the newest script of any page and where its steps lie. Any thread.
class WaypointBoard {
 public:
  /// From now on this script's steps; none: nothing.
  std::vector<PlacedStep> set(std::optional<Script> script, std::optional<int> selected,
                              const SimSnapshot& scene, ScratchWorld& scratch);
  /// Follows what has moved. True when something lies elsewhere than before.
  bool follow(const SimSnapshot& scene, ScratchWorld& scratch);
  std::vector<PlacedStep> steps() const;
  std::optional<int> selected() const;

 private:
  std::vector<PlacedStep> place(const SimSnapshot& scene, ScratchWorld& scratch) const;

  mutable std::mutex mutex_;
  std::optional<Script> script_;
  std::optional<int> selected_;
  /// Where the arm was when the script came or the episode began: while it moves, the choice of yaws stays.
  RobotState start_;
  std::uint64_t episode_ = 0;
  std::vector<PlacedStep> steps_;
};

}  // namespace flowscope
