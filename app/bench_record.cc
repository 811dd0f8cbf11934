#include "app/bench_record.h"

#include <chrono>

#include "recorder/demo_store.h"
#include "recorder/record.h"
#include "recorder/task.h"
#include "render/renderer.h"

namespace flowscope {
namespace {

using Clock = std::chrono::steady_clock;

double since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

constexpr const char* table_1[] = {"close_jar",          "open_drawer",    "sweep_to_dustpan_of_size",
                                   "meat_off_grill",     "turn_tap",       "slide_block_to_color_target",
                                   "put_item_in_drawer", "reach_and_drag", "push_buttons",
                                   "stack_blocks"};

struct Seconds {
  double simulated = 0, wall = 0, pictures = 0;
  Seconds& operator+=(const Seconds& more) {
    simulated += more.simulated;
    wall += more.wall;
    pictures += more.pictures;
    return *this;
  }
  BenchResult row(const std::string& name) const {
    return {"record " + name, simulated / wall, "sim s/s", simulated / wall, "real time"};
  }
};

Seconds record_task(const std::shared_ptr<const Task>& task, const DemoStore& store, int episodes) {
  World world(task);
  Renderer renderer(task->model(), task->name());
  Seconds sum;
  const auto observe = [&](const SceneState& state) {
    const auto start = Clock::now();
    Observation seen = renderer.observe_all(state, observation_cameras(task->model()), observation_size);
    sum.pictures += since(start);
    return seen;
  };
  world.reset(0, 0);
  observe(world.state());  // textures and shadow map are made by the first picture
  sum = {};
  const auto start = Clock::now();
  for (int i = 0; i < episodes; ++i) {
    world.reset(i % task->variations(), static_cast<std::uint64_t>(i));
    const RunReport report = run_script(world, world.episode().demonstration, observe);
    sum.simulated += report.sim_seconds;
    if (report.demo) store.save(*report.demo);
  }
  sum.wall = since(start);
  return sum;
}

}  // namespace

std::vector<BenchResult> bench_record(const std::filesystem::path& assets,
                                      const std::filesystem::path& scratch, int episodes) {
  const TaskLibrary tasks(assets);
  const DemoStore store(scratch);
  std::vector<BenchResult> rows;
  Seconds all;
  for (const char* name : table_1) {
    const Seconds task = record_task(tasks.get(name), store, episodes);
    rows.push_back(task.row(name));
    all += task;
  }
  rows.push_back(all.row("ten tasks"));
  rows.push_back({"record pictures", 100 * all.pictures / all.wall, "% of time", {}, {}});
  return rows;
}

}  // namespace flowscope
