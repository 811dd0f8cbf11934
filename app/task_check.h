// How reliable tasks are: their own demonstrations on random placements, without pictures.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "recorder/task.h"

namespace flowscope {

struct TaskCheckFailure {
  int variation = 0;
  std::uint64_t seed = 0;
  std::string reason;
};

struct VariationCheck {
  int runs = 0, successes = 0;
};

struct TaskCheck {
  std::string task;
  int variations = 0, runs = 0, successes = 0;
  int done_at_start = 0;                      ///< placements that counted as done before anything moved
  int done_early = 0;                         ///< runs that counted as done at the last but one keyframe
  double keyframes = 0;                       ///< mean over the successful runs
  std::optional<double> published_keyframes;  ///< what the mean should be near
  int keyframes_seen = 0;                     ///< of all successful runs
  std::vector<TaskCheckFailure> outside;      ///< keyframes that left the task's bounds
  double sim_seconds = 0, wall_seconds = 0;   ///< of all runs together
  std::vector<TaskCheckFailure> failures;
  std::vector<VariationCheck> by_variation;

  /// The variation with the smallest share of successes; none before a run.
  std::optional<int> weakest() const;
  /// At least 95 % of the runs succeed and not before their last keyframe, none is done before it begins, and
  /// their keyframes lie inside the bounds and number what is published, give or take 15 %. 95 % of each
  /// variation too, where it ran at least 20 times: with fewer one failure says little.
  bool holds() const;
};

/// `runs` demonstrations with seeds from `first_seed` on, all variations in turn. One thread.
TaskCheck check_task(const std::shared_ptr<const Task>& task, int runs, std::uint64_t first_seed);

}  // namespace flowscope
