#include "app/evaluate.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <exception>
#include <memory>
#include <mutex>
#include <thread>

#include "app/scene_input.h"
#include "app/sim_loop.h"
#include "policy/policy.h"
#include "recorder/lost_things.h"
#include "recorder/record.h"
#include "render/renderer.h"

namespace flowscope {

std::uint64_t eval_seed(int seed, int episode) { return 1'000'000ull + 10'000ull * seed + episode; }

int eval_variation(int variations, int seed, int episode) {
  std::uint64_t z =
      eval_seed(seed, episode) * 0x9E3779B97F4A7C15ull;  // splitmix64: every variation gets its turn
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
  return static_cast<int>((z ^ (z >> 31)) % static_cast<std::uint64_t>(variations));
}

std::pair<double, double> wilson_interval(int successes, int trials) {
  if (trials == 0) return {0, 1};
  const double z = 1.959964, n = trials, p = successes / n;
  const double center = p + z * z / (2 * n), spread = z * std::sqrt(p * (1 - p) / n + z * z / (4 * n * n));
  return {std::max(0.0, (center - spread) / (1 + z * z / n)),
          std::min(1.0, (center + spread) / (1 + z * z / n))};
}

namespace {

constexpr int most_steps = 20;  // keyframes per episode, as in the method's own evaluation

struct Outcome {
  bool success = false, first_attempt = false, left_workspace = false;
  std::string why;
  std::vector<PoseError> errors;
  int predictions = 0;
  double ms = 0;  // of all predictions together
};

/// One thread's tools; never shared.
struct Bench {
  Bench(std::shared_ptr<const Task> task, const std::filesystem::path& file)
      : world(task), renderer(task->model(), task->name()), policy(load_policy(file)) {}
  Observation observe(const SceneState& state) {
    return renderer.observe_all(state, observation_cameras(world.task().model()), observation_size);
  }
  World world;
  Renderer renderer;
  std::unique_ptr<Policy> policy;
};

/// The expert's run on the same scene: what the policy would have said at each of its keyframes.
std::vector<PoseError> errors_on_expert(Bench& bench, const PredictOptions& options) {
  const RunReport report = run_script(bench.world, bench.world.episode().demonstration,
                                      [&](const SceneState& state) { return bench.observe(state); });
  std::vector<PoseError> errors;
  if (!report.demo) return errors;
  for (int k = 0; k < static_cast<int>(report.demo->keyframes.size()); ++k) {
    FlowTrace trace = bench.policy->predict(input_of(*report.demo, k), options);
    compare_with_expert(trace, report.demo->keyframes[k].action);
    errors.push_back(*trace.error);
  }
  return errors;
}

FlowTrace predict_timed(Bench& bench, const PolicyInput& input, const PredictOptions& options,
                        Outcome& outcome) {
  const auto start = std::chrono::steady_clock::now();
  FlowTrace trace = bench.policy->predict(input, options);
  outcome.ms += std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  ++outcome.predictions;
  return trace;
}

Outcome run_episode(Bench& bench, int variation, std::uint64_t seed, const EvalOptions& eval) {
  PredictOptions options;
  options.flow_steps = eval.flow_steps;
  options.integrator = eval.integrator;
  options.seed = seed;
  Outcome outcome;
  World& world = bench.world;
  world.reset(variation, seed);
  outcome.errors = errors_on_expert(bench, options);

  world.reset(variation, seed);
  const SceneState start = world.state();
  PolicyInput input;
  input.instruction = world.episode().instructions.front();
  input.robot = world.task().robot().name;
  const int attempt = world.task().keyframes();
  for (int step = 0; step < most_steps && !world.success(); ++step) {
    const int k = step % attempt;  // not done where the longest demonstration is: it starts over from here
    if (k == 0) input.history = {world.robot()};
    input.observation = bench.observe(world.state());
    input.keyframe_index = k;
    options.seed = seed + static_cast<std::uint64_t>(step);
    const FlowTrace trace = predict_timed(bench, input, options, outcome);
    const MotionResult moved =
        execute_keyframe(world, trace.result, seed, [&](const Frame&) { return !world.success(); });
    if (!moved && !world.success() && outcome.why.empty()) {
      outcome.why = "step " + std::to_string(step) + ": " + to_string(moved.failure) + ": " + moved.message;
    }
    input.history.push_back(world.robot());
    outcome.first_attempt = world.success() && step < attempt;
  }
  outcome.success = world.success();
  if (!outcome.success) {
    for (const auto& term : world.terms()) {
      if (!term.met) {
        outcome.why += (outcome.why.empty() ? "" : "; ") + term.name + " is false (" + term.value + ")";
        break;
      }
    }
    const std::string lost = lost_text(world, start);
    outcome.left_workspace = !lost.empty();
    outcome.why += lost;
  }
  return outcome;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

EvalRow summarise(const std::string& name, const EvalOptions& options, const std::vector<Outcome>& outcomes,
                  int variations) {
  EvalRow row;
  row.task = name;
  std::vector<double> mm, deg;
  int successes = 0, first_attempts = 0, predictions = 0;
  for (int s = 0; s < options.seeds; ++s) {
    int won = 0;
    for (int e = 0; e < options.episodes; ++e) {
      const Outcome& o = outcomes[static_cast<std::size_t>(s) * options.episodes + e];
      won += o.success;
      first_attempts += o.first_attempt;
      row.left_workspace += o.left_workspace;
      predictions += o.predictions;
      row.ms += o.ms;
      if (!o.success) {
        const int set = options.first_seed + s;
        row.failures.push_back("seed " + std::to_string(eval_seed(set, e)) + " variation " +
                               std::to_string(eval_variation(variations, set, e)) + ": " + o.why);
      }
      for (const auto& error : o.errors) {
        mm.push_back(error.position_m * 1000);
        deg.push_back(error.rotation_deg);
      }
    }
    successes += won;
    row.by_seed.push_back(static_cast<double>(won) / options.episodes);
  }
  const int trials = options.seeds * options.episodes;
  row.successes = successes;
  row.first_attempts = first_attempts;
  row.episodes = trials;
  row.success = static_cast<double>(successes) / trials;
  row.ms /= std::max(1, predictions);
  row.first_attempt = static_cast<double>(first_attempts) / trials;
  std::tie(row.low, row.high) = wilson_interval(successes, trials);
  row.position_mm = median(mm);
  row.rotation_deg = median(deg);
  row.keyframes = static_cast<int>(mm.size());
  return row;
}

}  // namespace

std::vector<EvalRow> evaluate(const TaskLibrary& tasks, const EvalOptions& options,
                              const std::function<void(int, int)>& progress) {
  load_policy(options.policy);  // a bad file is said before anything is simulated
  const int per_task = options.seeds * options.episodes;
  const int all = per_task * static_cast<int>(options.tasks.size());
  std::atomic<int> done{0};
  std::vector<EvalRow> rows;
  for (const auto& name : options.tasks) {
    const auto task = tasks.get(name);
    task->model();  // compiled once, before the workers share it
    std::vector<Outcome> outcomes(per_task);
    std::atomic<int> next{0};
    std::mutex mutex;
    std::exception_ptr failed;
    auto work = [&] {
      try {
        Bench bench(task, options.policy);
        for (int i = next++; i < per_task; i = next++) {
          const int s = options.first_seed + i / options.episodes, e = i % options.episodes;
          outcomes[i] =
              run_episode(bench, eval_variation(task->variations(), s, e), eval_seed(s, e), options);
          const int count = ++done;
          std::lock_guard lock(mutex);
          progress(count, all);
        }
      } catch (...) {
        std::lock_guard lock(mutex);
        failed = std::current_exception();
        next = per_task;
      }
    };
    {
      std::vector<std::jthread> workers;
      for (int w = 0; w < std::max(1, options.workers); ++w) workers.emplace_back(work);
    }
    if (failed) std::rethrow_exception(failed);
    rows.push_back(summarise(name, options, outcomes, task->variations()));
  }
  return rows;
}

}  // namespace flowscope
