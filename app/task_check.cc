#include "app/task_check.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "recorder/record.h"
#include "recorder/world.h"

namespace flowscope {
namespace {

std::string where_outside(const Box& bounds, const Eigen::Vector3d& position, std::size_t keyframe) {
  const Eigen::Vector3d nearest = position.cwiseMax(bounds.min).cwiseMin(bounds.max);
  const Eigen::Vector3d over_mm = 1e3 * (position - nearest);
  char text[120];
  std::snprintf(text, sizeof text, "keyframe %zu lies (%.1f, %.1f, %.1f) mm outside the bounds", keyframe + 1,
                over_mm.x(), over_mm.y(), over_mm.z());
  return text;
}

/// `bounds` are the task's own: a demonstration's are widened to what it did.
void count_keyframes(const Demo& demo, const Box& bounds, const std::vector<bool>& done, TaskCheck& sum) {
  sum.keyframes += static_cast<double>(demo.keyframes.size());
  for (std::size_t k = 0; k < demo.keyframes.size(); ++k) {
    const Eigen::Vector3d& position = demo.keyframes[k].action.world_from_tool.position;
    ++sum.keyframes_seen;
    if (!bounds.contains(position))
      sum.outside.push_back({demo.info.variation, demo.info.seed, where_outside(bounds, position, k)});
  }
  if (demo.keyframes.size() < 2) return;
  const auto cut = static_cast<std::size_t>(demo.keyframes[demo.keyframes.size() - 2].frame);
  if (cut < done.size() && done[cut]) ++sum.done_early;
}

bool enough(int successes, int runs) { return 20 * successes >= 19 * runs; }

}  // namespace

std::optional<int> TaskCheck::weakest() const {
  std::optional<int> weakest;
  for (int v = 0; v < static_cast<int>(by_variation.size()); ++v) {
    const VariationCheck& one = by_variation[v];
    if (one.runs == 0) continue;
    if (!weakest || one.successes * by_variation[*weakest].runs < by_variation[*weakest].successes * one.runs)
      weakest = v;
  }
  return weakest;
}

bool TaskCheck::holds() const {
  constexpr int runs_that_tell = 20;
  const bool as_published = !published_keyframes || std::abs(keyframes / *published_keyframes - 1) <= 0.15;
  const bool each = std::ranges::all_of(by_variation, [](const VariationCheck& one) {
    return one.runs < runs_that_tell || enough(one.successes, one.runs);
  });
  return enough(successes - done_early, runs) && each && done_at_start == 0 && outside.empty() &&
         as_published;
}

TaskCheck check_task(const std::shared_ptr<const Task>& task, int runs, std::uint64_t first_seed) {
  TaskCheck sum;
  sum.task = task->name();
  sum.variations = task->variations();
  sum.runs = runs;
  sum.published_keyframes = task->published_keyframes();
  sum.by_variation.resize(static_cast<std::size_t>(sum.variations));
  World world(task);
  const auto no_picture = [](const SceneState&) { return Observation{}; };
  for (int i = 0; i < runs; ++i) {
    const int variation = i % sum.variations;
    const std::uint64_t seed = first_seed + static_cast<std::uint64_t>(i);
    world.reset(variation, seed);
    if (world.success()) ++sum.done_at_start;
    std::vector<bool> done;
    const RunReport report = run_script(world, world.episode().demonstration, no_picture,
                                        [&](const Frame&) { done.push_back(world.success()); });
    sum.sim_seconds += report.sim_seconds;
    sum.wall_seconds += report.wall_seconds;
    VariationCheck& one = sum.by_variation[static_cast<std::size_t>(variation)];
    ++one.runs;
    if (!report.success) {
      sum.failures.push_back({variation, seed, report.reason});
      continue;
    }
    ++sum.successes;
    ++one.successes;
    count_keyframes(*report.demo, task->bounds(), done, sum);
  }
  if (sum.successes > 0) sum.keyframes /= sum.successes;
  return sum;
}

}  // namespace flowscope
