// flowscope record: scripted runs on one thread, each successful one saved as a demonstration.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numeric>
#include <random>

#include "app/cli.h"
#include "app/commands.h"
#include "app/data_lock.h"
#include "app/progress.h"
#include "app/scene_options.h"
#include "recorder/demo_store.h"
#include "recorder/record.h"
#include "recorder/script_check.h"
#include "recorder/task.h"
#include "recorder/world.h"
#include "render/renderer.h"
#include "web/wire_terms.h"

namespace flowscope::app {
namespace {

constexpr double frame_seconds = 0.05;  ///< from one value of a term to the next

struct RecordCall {
  std::string task;
  int episodes = 1;
  std::string variation = "0";
  std::uint64_t seed = 0;
  std::string script;                  ///< file; empty: the task's own demonstration
  std::vector<std::string> task_dirs;  ///< folders of further tasks
  SceneCall scene;                     ///< in place of a task
  bool terms = true;                   ///< with --json: every success term at every frame
};

/// Which variation each episode shows: always the same, or all in turns, every turn in an order of its own.
std::vector<int> variations_of(const RecordCall& call, const Task& task) {
  if (call.variation != "all") {
    int variation = 0;
    if (!CLI::detail::lexical_cast(call.variation, variation) || variation < 0 ||
        variation >= task.variations()) {
      throw UsageError("--variation: " + call.variation + " is neither all nor one of 0 … " +
                       std::to_string(task.variations() - 1));
    }
    return std::vector<int>(call.episodes, variation);
  }
  std::mt19937_64 random(call.seed);
  std::vector<int> turn(task.variations()), all;
  std::iota(turn.begin(), turn.end(), 0);
  while (static_cast<int>(all.size()) < call.episodes) {
    std::shuffle(turn.begin(), turn.end(), random);
    all.insert(all.end(), turn.begin(), turn.end());
  }
  all.resize(call.episodes);
  return all;
}

Script read_script(const std::string& file, const Task& task) {
  std::ifstream stream(file, std::ios::binary);
  const std::string text(std::istreambuf_iterator<char>(stream), {});
  if (!stream) throw UsageError("--script: cannot read " + file);
  Script script = parse_script(text, file);
  check_script(script, task);  // once, before the arm moves, and not in every episode
  return script;
}

RunReport run_episode(World& world, Renderer& renderer, const std::optional<Script>& script, int variation,
                      std::uint64_t seed) {
  const Observe observe = [&](const SceneState& state) {
    return renderer.observe_all(state, observation_cameras(world.task().model()), observation_size);
  };
  try {
    world.reset(variation, seed);
    return run_script(world, script ? *script : world.episode().demonstration, observe);
  } catch (const SimulationFailed& error) {
    RunReport report;
    report.reason = error.what();
    return report;
  }
}

/// Its id; empty, with the reason in the report, when there is nothing to save or the store refuses it.
std::string save(const DemoStore& store, RunReport& report) {
  if (!report.demo) return "";
  try {
    return store.save(*report.demo);
  } catch (const RefusedDemo& error) {
    report.reason = std::string("not saved: ") + error.what();
    return "";
  }
}

nlohmann::ordered_json failure_json(const RunReport& report, int variation, std::uint64_t seed) {
  nlohmann::ordered_json waypoint;  // null when no waypoint is to blame
  if (report.step >= 0) waypoint = report.step + 1;
  return {{"seed", seed}, {"variation", variation}, {"waypoint", waypoint}, {"reason", report.reason}};
}

nlohmann::ordered_json attempt_json(const RunReport& report, int variation, std::uint64_t seed) {
  nlohmann::ordered_json terms = nlohmann::ordered_json::array();
  for (const TermSeries& series : report.terms) terms.push_back(web::wire::to_json(series));
  return {{"seed", seed}, {"variation", variation}, {"success", report.success}, {"terms", terms}};
}

std::shared_ptr<const Task> find_task(const RecordCall& call) {
  if (!call.scene.scene.empty()) {
    if (call.scene.robot.empty()) {
      throw UsageError("--robot: recording in " + call.scene.scene.string() +
                       " needs the description of its robot");
    }
    if (call.script.empty()) throw UsageError("--script: a scene has no demonstration of its own");
    return open_scene(call.scene, find_assets());
  }
  if (call.task.empty()) throw UsageError("TASK: give the name of a task, or --scene FILE");
  const TaskLibrary library(find_assets(), {call.task_dirs.begin(), call.task_dirs.end()});
  try {
    return library.get(call.task);
  } catch (const std::invalid_argument& error) {
    throw UsageError(std::string("TASK: ") + error.what());
  }
}

int record(const RecordCall& call, const Context& context) {
  const auto begin = std::chrono::steady_clock::now();
  const std::shared_ptr<const Task> task = find_task(call);
  const std::vector<int> variations = variations_of(call, *task);
  std::optional<Script> script;
  if (!call.script.empty()) script = read_script(call.script, *task);
  const FileLock lock = lock_data(context.data, "record " + task->name());
  const DemoStore store(context.data);
  World world(task);
  Renderer renderer(task->model(), task->name());

  nlohmann::ordered_json demos = nlohmann::ordered_json::array(), failed = nlohmann::ordered_json::array(),
                         attempts = nlohmann::ordered_json::array();
  double sim_seconds = 0;
  {
    Progress progress("episode", call.episodes);
    for (int i = 0; i < call.episodes; ++i) {
      const std::uint64_t seed = call.seed + static_cast<std::uint64_t>(i);
      RunReport report = run_episode(world, renderer, script, variations[i], seed);
      sim_seconds += report.sim_seconds;
      if (context.json && call.terms) attempts.push_back(attempt_json(report, variations[i], seed));
      std::string outcome;
      if (const std::string id = save(store, report); !id.empty()) {
        demos.push_back(id);
        outcome = "saved " + id + ", " + std::to_string(report.demo->frames.size()) + " frames, " +
                  std::to_string(report.demo->keyframes.size()) + " keyframes";
      } else {
        failed.push_back(failure_json(report, variations[i], seed));
        outcome = "failed: " + report.reason;
      }
      progress.report(i + 1, "variation " + std::to_string(variations[i]) + ", seed " + std::to_string(seed) +
                                 ": " + outcome);
    }
  }
  const double wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const std::size_t saved = demos.size();
  if (context.json) {
    nlohmann::ordered_json document{{"task", task->name()},
                                    {"attempted", call.episodes},
                                    {"saved", saved},
                                    {"demos", demos},
                                    {"failed", failed},
                                    {"sim_seconds", sim_seconds},
                                    {"wall_seconds", wall_seconds}};
    if (call.terms) {
      document["frame_seconds"] = frame_seconds;
      document["attempts"] = attempts;
    }
    print_json(document);
  } else {
    std::printf("%zu of %d saved in %s: %.1f s simulated in %.1f s\n", saved, call.episodes,
                context.data.c_str(), sim_seconds, wall_seconds);
  }
  return saved > 0 ? 0 : 1;
}

}  // namespace

void add_record_command(CLI::App& root, Context& context) {
  CLI::App* command = root.add_subcommand("record", "Record demonstrations from a task's waypoint script");
  auto call = std::make_shared<RecordCall>();
  CLI::Option* task =
      command->add_option("task", call->task, "Name of the task (see flowscope tasks)")->type_name("TASK");
  add_scene_options(*command, call->scene)->excludes(task);
  command->add_option("--episodes", call->episodes, "Runs to attempt")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  command->add_option("--variation", call->variation, "One variation, or all in turns")
      ->type_name("K|all")
      ->capture_default_str();
  command->add_option("--seed", call->seed, "Seed of the first run; the next takes the next seed")
      ->capture_default_str();
  command->add_option("--script", call->script, "Waypoint script to run instead of the task's own")
      ->type_name("FILE");
  command->add_option("--tasks", call->task_dirs, "Folder of further tasks")
      ->type_name("DIR")
      ->allow_extra_args(false);
  command->add_flag(
      "--terms,!--no-terms", call->terms,
      "With --json: every success term with its value at every frame, also of runs that failed");
  add_data_option(*command, context);
  add_json_option(*command, context);
  add_egl_option(*command, context);
  set_body(*command, context, [call, &context] { return record(*call, context); });
}

}  // namespace flowscope::app
