// How fast a policy learns: minutes of training on demonstrations of one task, error on unseen ones.
//   learn_bench TASK DEMOS MINUTES|STEPSs [preset] [threads] [data folder with real demonstrations]
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <numbers>
#include <string>
#include <vector>

#include "policy/sample.h"
#include "policy/torch_parts.h"
#include "policy/trainer.h"
#include "recorder/demo_store.h"
#include "tests/support/synthetic_demo.h"

namespace {

using flowscope::Demo;

std::vector<Demo> demos_of(const std::string& task, int count, int unseen, const std::string& folder) {
  std::vector<Demo> demos;
  if (folder.empty()) {
    for (int i = 0; i < count + unseen; ++i)
      demos.push_back(flowscope::testing::toy_demo(task, static_cast<std::uint64_t>(i)));
    return demos;
  }
  const flowscope::DemoStore store(folder);
  for (const auto& info : store.list())
    if (info.task == task && static_cast<int>(demos.size()) < count + unseen)
      demos.push_back(store.load_keyframes(info.id));
  return demos;
}

struct Errors {
  std::vector<double> mm, degrees;
  int open_wrong = 0;
};

double quantile(std::vector<double> v, double q) {
  std::sort(v.begin(), v.end());
  return v.empty() ? 0 : v[static_cast<std::size_t>(q * static_cast<double>(v.size() - 1))];
}

double within(const std::vector<double>& v, double limit) {
  return 100.0 * static_cast<double>(std::count_if(v.begin(), v.end(), [&](double x) { return x < limit; })) /
         static_cast<double>(v.size());
}

void report(flowscope::Trainer& trainer, const std::vector<Demo>& demos, std::size_t first, int flow_steps) {
  Errors all;
  std::vector<Errors> by_keyframe;
  for (std::size_t d = first; d < demos.size(); ++d) {
    for (std::size_t k = 0; k < demos[d].keyframes.size(); ++k) {
      flowscope::PredictOptions options;
      options.flow_steps = flow_steps;
      options.seed = d * 100 + k;
      const auto trace =
          trainer.predict(flowscope::input_of_keyframe(demos[d], static_cast<int>(k)), options);
      const auto& expert = demos[d].keyframes[k].action;
      by_keyframe.resize(std::max(by_keyframe.size(), k + 1));
      for (Errors* e : {&all, &by_keyframe[k]}) {
        e->mm.push_back(1000 * position_error_m(trace.result.world_from_tool, expert.world_from_tool));
        e->degrees.push_back(180 / std::numbers::pi *
                             rotation_error_rad(trace.result.world_from_tool, expert.world_from_tool));
        e->open_wrong += trace.result.open() != expert.open();
      }
    }
  }
  std::printf(
      "  unseen: %zu keyframes, median %.1f mm (90 %%: %.1f), %.1f deg (90 %%: %.1f), < 5 mm %.0f %%, < 20 "
      "mm %.0f %%, "
      "open wrong %d |",
      all.mm.size(), quantile(all.mm, .5), quantile(all.mm, .9), quantile(all.degrees, .5),
      quantile(all.degrees, .9), within(all.mm, 5), within(all.mm, 20), all.open_wrong);
  for (const Errors& e : by_keyframe)
    std::printf(" %.1f/%.1f mm %.1f/%.1f deg", quantile(e.mm, .5), quantile(e.mm, .9),
                quantile(e.degrees, .5), quantile(e.degrees, .9));
  std::printf("\n");
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4)
    return std::fprintf(stderr, "learn_bench TASK DEMOS MINUTES [preset] [threads] [data folder]\n"), 2;
  const std::string task = argv[1];
  const int count = std::stoi(argv[2]);
  // "3": three minutes, the learning rate falls to their end; "2000s": so many steps at a level rate,
  // whatever the load.
  const std::string amount = argv[3];
  const bool by_steps = amount.ends_with("s");
  const double end = std::stod(amount);
  at::set_num_threads(argc > 5 ? std::stoi(argv[5]) : 1);
  const std::vector<Demo> demos = demos_of(task, count, 20, argc > 6 ? argv[6] : "");
  flowscope::TrainOptions options;
  if (argc > 4) options.preset = argv[4];
  if (!by_steps) options.expected_minutes = end;
  const auto trainer = flowscope::Trainer::create(options);
  for (int i = 0; i < count; ++i) trainer->add(demos[static_cast<std::size_t>(i)]);
  flowscope::TrainStatus s;
  double loss = 0;
  double next = end / 5, done = 0;
  while (done < end) {
    s = trainer->step();
    loss = s.step == 1 ? s.loss : 0.98 * loss + 0.02 * s.loss;
    done = by_steps ? static_cast<double>(s.step) : s.minutes;
    if (done >= next || done >= end) {
      std::printf("%.2f min, step %lld, loss %.3f, %.0f samples/s\n", s.minutes,
                  static_cast<long long>(s.step), loss, s.samples_per_s);
      report(*trainer, demos, static_cast<std::size_t>(count), 4);
      next += end / 5;
    }
  }
  for (const int steps : {1, 2, 8}) {
    std::printf("flow steps %d\n", steps);
    report(*trainer, demos, static_cast<std::size_t>(count), steps);
  }
}
