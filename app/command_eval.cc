// flowscope eval: success on unseen scenes.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "app/cli.h"
#include "app/commands.h"
#include "app/evaluate.h"
#include "policy/policy.h"

namespace flowscope::app {
namespace {

/// Where the expert never succeeded there is nothing to compare with.
nlohmann::ordered_json if_measured(const EvalRow& row, double error) {
  return row.keyframes > 0 ? nlohmann::ordered_json(error) : nlohmann::ordered_json();
}

std::string if_measured(const EvalRow& row, const char* format, double error) {
  char text[40] = "–";
  if (row.keyframes > 0) std::snprintf(text, sizeof text, format, error);
  return text;
}

nlohmann::ordered_json as_json(const EvalOptions& options, const std::vector<EvalRow>& rows, double average) {
  nlohmann::ordered_json seeds = nlohmann::ordered_json::array(), list = nlohmann::ordered_json::array();
  for (int s = 0; s < options.seeds; ++s) seeds.push_back(options.first_seed + s);
  for (const auto& row : rows) {
    list.push_back({{"task", row.task},
                    {"success", row.success},
                    {"interval", {row.low, row.high}},
                    {"by_seed", row.by_seed},
                    {"first_attempt", row.first_attempt},
                    {"position_mm", if_measured(row, row.position_mm)},
                    {"rotation_deg", if_measured(row, row.rotation_deg)},
                    {"keyframes", row.keyframes},
                    {"left_workspace", row.left_workspace},
                    {"ms_per_prediction", row.ms},
                    {"failures", row.failures}});
  }
  return {{"policy", options.policy.string()},
          {"flow_steps", options.flow_steps},
          {"integrator", options.integrator},
          {"episodes", options.episodes},
          {"seeds", seeds},
          {"rows", list},
          {"average", average}};
}

int eval(const EvalOptions& options, bool markdown, const Context& context) {
  const TaskLibrary tasks(find_assets());
  std::vector<EvalRow> rows;
  try {
    rows = evaluate(tasks, options, [](int done, int all) {
      if (done % 5 == 0 || done == all) std::fprintf(stderr, "%d of %d episodes\n", done, all);
    });
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
  double average = 0;
  for (const auto& row : rows) average += row.success / static_cast<double>(rows.size());
  if (context.json) {
    print_json(as_json(options, rows, average));
    return 0;
  }
  const char* line =
      markdown ? "| %s | %.1f %% | %.1f–%.1f | %.1f %% | %s | %s | %.1f |\n"
               : "%-28s %5.1f %%  [%.1f, %.1f]  first attempt %5.1f %%  %6s mm  %6s deg  %6.1f ms\n";
  if (markdown)
    std::printf(
        "| task | success | 95 %% interval | first attempt | position mm | rotation deg | ms per prediction "
        "|\n|---|---|---|---|---|---|---|\n");
  for (const auto& row : rows) {
    std::printf(line, row.task.c_str(), 100 * row.success, 100 * row.low, 100 * row.high,
                100 * row.first_attempt, if_measured(row, "%.1f", row.position_mm).c_str(),
                if_measured(row, "%.2f", row.rotation_deg).c_str(), row.ms);
    for (const auto& failure : row.failures) std::fprintf(stderr, "  %s\n", failure.c_str());
  }
  return 0;
}

}  // namespace

void add_eval_command(CLI::App& root, Context& context) {
  CLI::App* command = root.add_subcommand("eval", "Measure a policy's success on unseen scenes");
  auto options = std::make_shared<EvalOptions>();
  auto markdown = std::make_shared<bool>(false);
  command->add_option("--policy", options->policy, "Trained policy")->required();
  command->add_option("--tasks", options->tasks, "Tasks, separated by commas")->delimiter(',')->required();
  command->add_option("--episodes", options->episodes, "Scenes per seed")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--seeds", options->seeds, "Sets of scenes")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command
      ->add_option("--first-seed", options->first_seed,
                   "The first of these sets; every number has scenes of its own")
      ->check(CLI::Range(0, 1'000'000))
      ->capture_default_str();
  command->add_option("--flow-steps", options->flow_steps, "Steps of the flow")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command->add_option("--integrator", options->integrator, "How steps follow the velocity")
      ->check(CLI::IsMember({"euler", "midpoint", "rk4"}))
      ->capture_default_str();
  command->add_option("--workers", options->workers, "Threads; successes do not depend on them, times do")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  add_egl_option(*command, context);
  CLI::Option* json = add_json_option(*command, context);
  command->add_flag("--markdown", *markdown, "Print a Markdown table")->excludes(json);
  set_body(*command, context, [options, markdown, &context] { return eval(*options, *markdown, context); });
}

}  // namespace flowscope::app
