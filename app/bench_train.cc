#include "app/bench_train.h"

#include "policy/bench_learning.h"
#include "recorder/record.h"
#include "recorder/task.h"
#include "render/renderer.h"

namespace flowscope {

std::vector<BenchResult> bench_train(const std::filesystem::path& assets, const std::string& preset,
                                     int steps) {
  const TaskLibrary tasks(assets);
  const auto task = tasks.get("push_buttons");
  World world(task);
  Renderer renderer(task->model(), task->name());
  std::vector<Demo> demos;
  for (int i = 0; i < 2; ++i) {
    world.reset(3 * i, static_cast<std::uint64_t>(i));
    RunReport report = run_script(world, world.episode().demonstration, [&](const SceneState& state) {
      return renderer.observe_all(state, observation_cameras(task->model()), observation_size);
    });
    if (!report.demo) throw std::runtime_error("bench: the demonstration failed: " + report.reason);
    demos.push_back(std::move(*report.demo));
    demos.back().info.id = "bench-" + std::to_string(i);
  }
  return bench_learning(demos, {.preset = preset, .steps = steps, .plain_steps = 2});
}

}  // namespace flowscope
