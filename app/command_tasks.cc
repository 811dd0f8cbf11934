// flowscope tasks: which tasks there are, with their variations and instructions, and how reliable they are.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <cstdio>
#include <exception>
#include <functional>
#include <mutex>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <thread>

#include "app/cli.h"
#include "app/commands.h"
#include "app/task_check.h"
#include "recorder/task.h"
#include "web/wire.h"

namespace flowscope::app {
namespace {

web::TaskEntry entry_of(const Task& task) {
  web::TaskEntry entry{task.name(), task.variations(), {}};
  for (int variation = 0; variation < task.variations(); ++variation) {
    entry.instructions.push_back(task.instructions(variation).front());
  }
  return entry;
}

int list_tasks(const std::vector<std::string>& folders, bool json) {
  const TaskLibrary library(find_assets(), {folders.begin(), folders.end()});
  nlohmann::ordered_json tasks = nlohmann::ordered_json::array();
  for (const std::string& name : library.names()) {
    const web::TaskEntry entry = entry_of(*library.get(name));
    tasks.push_back(web::wire::to_json(entry));
    if (json) continue;
    std::printf("%-32s %3d variations   %s\n", name.c_str(), entry.variations,
                entry.instructions.empty() ? "" : entry.instructions.front().c_str());
  }
  if (json) print_json({{"tasks", tasks}});
  return 0;
}

struct CheckCall {
  std::vector<std::string> names;   ///< empty: all
  std::optional<int> runs;          ///< unset: 40, and every variation at least once
  std::optional<int> runs_of_each;  ///< of each variation, instead of `runs`
  std::uint64_t seed = 0;

  int runs_of(const Task& task) const {
    if (runs_of_each) return *runs_of_each * task.variations();
    return runs.value_or(std::max(40, task.variations()));
  }
};

nlohmann::ordered_json as_json(const std::vector<TaskCheckFailure>& failures) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const TaskCheckFailure& f : failures)
    list.push_back({{"variation", f.variation}, {"seed", f.seed}, {"reason", f.reason}});
  return list;
}

nlohmann::ordered_json as_json(const std::vector<VariationCheck>& variations) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const VariationCheck& v : variations) list.push_back({{"runs", v.runs}, {"successes", v.successes}});
  return list;
}

nlohmann::ordered_json as_json(const TaskCheck& c) {
  nlohmann::ordered_json published;  // null where nothing is published
  if (c.published_keyframes) published = *c.published_keyframes;
  return {{"task", c.task},
          {"variations", c.variations},
          {"runs", c.runs},
          {"successes", c.successes},
          {"by_variation", as_json(c.by_variation)},
          {"done_at_start", c.done_at_start},
          {"done_early", c.done_early},
          {"keyframes", c.keyframes},
          {"published_keyframes", published},
          {"keyframes_seen", c.keyframes_seen},
          {"outside", as_json(c.outside)},
          {"sim_seconds", c.sim_seconds},
          {"wall_seconds", c.wall_seconds},
          {"holds", c.holds()},
          {"failures", as_json(c.failures)}};
}

void print_row(const TaskCheck& c) {
  char published[16] = "", weakest[48] = "";
  if (const auto v = c.weakest()) {
    const VariationCheck& one = c.by_variation[static_cast<std::size_t>(*v)];
    std::snprintf(weakest, sizeof weakest, "%d of %d", one.successes, one.runs);
  }
  if (c.published_keyframes) std::snprintf(published, sizeof published, "%.1f", *c.published_keyframes);
  std::printf("| %s | %d | %d of %d | %s | %.1f | %s | %zu of %d | %.1f | %s |\n", c.task.c_str(),
              c.variations, c.successes, c.runs, weakest, c.keyframes, published, c.outside.size(),
              c.keyframes_seen, c.sim_seconds / std::max(1, c.runs), c.holds() ? "yes" : "no");
}

/// As many tasks at a time as there are cores, those with the most runs first; in the order of their names.
std::vector<TaskCheck> check_all(const TaskLibrary& library, const std::vector<std::string>& names,
                                 const CheckCall& call) {
  std::vector<TaskCheck> checks(names.size());
  std::vector<std::size_t> order(names.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, std::greater<>{},
                           [&](std::size_t k) { return call.runs_of(*library.get(names[k])); });
  std::atomic<std::size_t> next = 0;
  std::exception_ptr failure;
  std::mutex mutex;
  {
    std::vector<std::jthread> workers;
    for (unsigned i = 0; i < std::max(1u, std::thread::hardware_concurrency()); ++i)
      workers.emplace_back([&] {
        try {
          for (std::size_t nth = next++; nth < names.size(); nth = next++) {
            const std::size_t k = order[nth];
            const auto task = library.get(names[k]);
            const int runs = call.runs_of(*task);
            checks[k] = check_task(task, runs, call.seed);
            std::fprintf(stderr, "%s: %d of %d\n", names[k].c_str(), checks[k].successes, runs);
          }
        } catch (...) {
          const std::lock_guard lock(mutex);
          failure = std::current_exception();
        }
      });
  }
  if (failure) std::rethrow_exception(failure);
  return checks;
}

int check_tasks(const std::vector<std::string>& folders, const CheckCall& call, bool json) {
  const TaskLibrary library(find_assets(), {folders.begin(), folders.end()});
  const std::vector<std::string> names = call.names.empty() ? library.names() : call.names;
  try {
    for (const std::string& name : names) library.get(name);
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
  const std::vector<TaskCheck> checks = check_all(library, names, call);
  if (json) {
    nlohmann::ordered_json tasks = nlohmann::ordered_json::array();
    for (const TaskCheck& c : checks) tasks.push_back(as_json(c));
    print_json({{"seed", call.seed}, {"tasks", tasks}});
  } else {
    std::printf(
        "| task | variations | success | weakest variation | keyframes | published | out of bounds | "
        "simulated s | "
        "holds |\n|---|---|---|---|---|---|---|---|---|\n");
    for (const TaskCheck& c : checks) print_row(c);
    for (const TaskCheck& c : checks)
      for (const auto& list : {c.failures, c.outside})
        for (const TaskCheckFailure& f : list)
          std::printf("\n%s, variation %d, seed %llu: %s", c.task.c_str(), f.variation,
                      static_cast<unsigned long long>(f.seed), f.reason.c_str());
    std::printf("\n");
  }
  return std::ranges::all_of(checks, &TaskCheck::holds) ? 0 : 1;
}

}  // namespace

void add_tasks_command(CLI::App& root, Context& context) {
  CLI::App* command =
      root.add_subcommand("tasks", "List the tasks with their variations and instructions, or check them");
  auto folders = std::make_shared<std::vector<std::string>>();
  command->add_option("--tasks", *folders, "Folder of further tasks")
      ->type_name("DIR")
      ->allow_extra_args(false);
  add_json_option(*command, context);
  CLI::App* check = command->add_subcommand(
      "check",
      "Run the tasks' own demonstrations on random placements; fails where one of twenty does not succeed");
  auto call = std::make_shared<CheckCall>();
  check->add_option("task", call->names, "Tasks; without any, all");
  auto* runs =
      check
          ->add_option(
              "--episodes", call->runs,
              "Placements of each task, all variations in turn; without it 40, or as many as variations")
          ->check(CLI::Range(1, 1000000));
  check
      ->add_option("--per-variation", call->runs_of_each,
                   "Placements of each variation instead; from 20 on each must hold")
      ->check(CLI::Range(1, 10000))
      ->excludes(runs);
  check->add_option("--seed", call->seed, "Seed of the first placement; the next takes the next seed")
      ->capture_default_str();
  check->add_option("--tasks", *folders, "Folder of further tasks")
      ->type_name("DIR")
      ->allow_extra_args(false);
  add_json_option(*check, context);
  // The outer command is asked last, whichever was meant.
  set_body(*command, context, [folders, call, check, &context] {
    return check->parsed() ? check_tasks(*folders, *call, context.json) : list_tasks(*folders, context.json);
  });
}

}  // namespace flowscope::app
