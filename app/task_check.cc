#include "app/task_check.h"

#include "recorder/record.h"
#include "recorder/world.h"

namespace flowscope {
namespace {

void count_keyframes(const Demo& demo, const std::vector<bool>& done, TaskCheck& sum) {
  sum.keyframes += static_cast<double>(demo.keyframes.size());
  for (const Keyframe& k : demo.keyframes) {
    ++sum.keyframes_seen;
    if (demo.bounds.contains(k.action.world_from_tool.position)) ++sum.keyframes_in_box;
  }
  if (demo.keyframes.size() < 2) return;
  const auto cut = static_cast<std::size_t>(demo.keyframes[demo.keyframes.size() - 2].frame);
  if (cut < done.size() && done[cut]) ++sum.done_early;
}

}  // namespace

TaskCheck check_task(const std::shared_ptr<const Task>& task, int runs, std::uint64_t first_seed) {
  TaskCheck sum;
  sum.task = task->name();
  sum.variations = task->variations();
  sum.runs = runs;
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
    if (!report.success) {
      sum.failures.push_back({variation, seed, report.reason});
      continue;
    }
    ++sum.successes;
    count_keyframes(*report.demo, done, sum);
  }
  if (sum.successes > 0) sum.keyframes /= sum.successes;
  return sum;
}

}  // namespace flowscope
