// flowscope ablate: trains and measures variants of a policy and prints the publication's tables.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>

#include "app/ablate.h"
#include "app/ablate_table.h"
#include "app/ablate_tools.h"
#include "app/cli.h"
#include "app/commands.h"
#include "recorder/atomic_file.h"
#include "recorder/task.h"

namespace flowscope::app {
namespace {

struct AblateCall {
  std::filesystem::path out, grid;
  AblationBudget budget;
  TableChoice tables{.names = {"3", "4", "C", "ours"}, .flow_steps = {}, .paper_form = false, .tasks = {}};
  int seeds = 3, workers = 1;
  bool list = false;
};

std::vector<AblationTable> tables_of(const AblateCall& call) {
  if (!call.grid.empty()) return {make_cell_table("Grid", read_grid(call.grid))};
  TableChoice choice = call.tables;
  choice.tasks = call.budget.tasks;
  std::vector<AblationTable> tables = make_tables(choice);
  std::vector<AblationCell> cells;
  for (const AblationTable& table : tables) cells.insert(cells.end(), table.cells.begin(), table.cells.end());
  tables.push_back(make_cell_table("All cells", cells));
  return tables;
}

std::string markdown_of(const std::vector<AblationTable>& tables, const AblationStore& store) {
  std::string text =
      "Success in % over all episodes of all training seeds [95 % Wilson interval] (each seed).\n";
  for (const AblationTable& table : tables) text += "\n" + table.markdown(store.runs());
  return text;
}

void print_states(const std::vector<CellState>& states) {
  std::map<std::string, int> count;
  for (const CellState& s : states) {
    ++count[to_string(s.kind)];
    std::printf("%-9s seed %d  %3d steps  %s%s\n", to_string(s.kind).c_str(), s.seed, s.cell.flow_steps,
                key_of(s.cell.variant).c_str(), s.reason.empty() ? "" : ("  (" + s.reason + ")").c_str());
  }
  std::string sum;
  for (const auto& [kind, n] : count) sum += (sum.empty() ? "" : ", ") + std::to_string(n) + " " + kind;
  std::printf("%zu cells: %s\n", states.size(), sum.c_str());
}

nlohmann::ordered_json as_json(const AblationStore& store, const std::vector<CellState>& states,
                               const std::string& markdown) {
  nlohmann::ordered_json document = store.document();
  nlohmann::ordered_json cells = nlohmann::ordered_json::array();
  for (const CellState& s : states)
    cells.push_back({{"key", key_of(s.cell.variant)},
                     {"seed", s.seed},
                     {"flow_steps", s.cell.flow_steps},
                     {"state", to_string(s.kind)},
                     {"reason", s.reason}});
  document["cells"] = cells;
  document["markdown"] = markdown;
  return document;
}

void write_text(const std::filesystem::path& file, const std::string& text) {
  write_file_atomically(file, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

int ablate(AblateCall call, const Context& context) {
  if ((call.budget.steps > 0) == (call.budget.minutes > 0))
    throw UsageError("--steps or --minutes says how long each policy trains");
  const std::filesystem::path data = existing_data(context), assets = find_assets();
  try {
    call.budget.demonstrations = sha256_of(demonstrations_of(DemoStore(data), call.budget.tasks));
    const std::vector<AblationTable> tables = tables_of(call);
    std::vector<AblationCell> cells;
    for (const AblationTable& table : tables)
      cells.insert(cells.end(), table.cells.begin(), table.cells.end());
    AblationStore store(call.out, call.budget);
    if (!call.list) {
      const auto write_tables = [&] { write_text(store.file("tables.md"), markdown_of(tables, store)); };
      run_ablation(
          store, cells, call.seeds, real_tools(call.budget, data, assets, call.workers),
          [](const std::string& line) { std::fprintf(stderr, "%s\n", line.c_str()); }, write_tables);
      write_tables();
    }
    const std::vector<CellState> states = cell_states(store, cells, call.seeds);
    if (context.json)
      print_json(as_json(store, states, markdown_of(tables, store)));
    else if (call.list)
      print_states(states);
    else
      std::printf("%s", markdown_of(tables, store).c_str());
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
  return 0;
}

}  // namespace

void add_ablate_command(CLI::App& root, Context& context) {
  CLI::App* command =
      root.add_subcommand("ablate", "Train and measure variants of a policy: the publication's tables");
  auto call = std::make_shared<AblateCall>();
  add_data_option(*command, context);
  command->add_option("--tasks", call->budget.tasks, "Tasks, separated by commas")
      ->delimiter(',')
      ->required();
  command
      ->add_option("--out", call->out, "Folder of results, tables and policies; starting again goes on there")
      ->required();
  CLI::Option* tables = command->add_option("--tables", call->tables.names, "Which: 3, 4, C, precise, ours")
                            ->delimiter(',')
                            ->check(CLI::IsMember({"3", "4", "C", "precise", "ours"}))
                            ->capture_default_str();
  command->add_option("--grid", call->grid, "YAML file with lists of values: every combination instead")
      ->check(CLI::ExistingFile)
      ->excludes(tables);
  command->add_option("--preset", call->budget.preset, "Size of the network")
      ->check(CLI::IsMember({"nano", "desk", "paper"}))
      ->capture_default_str();
  command->add_option("--minutes", call->budget.minutes, "Minutes to train each policy")
      ->check(CLI::PositiveNumber);
  command->add_option("--steps", call->budget.steps, "Optimiser steps to train each policy")
      ->check(CLI::PositiveNumber);
  command->add_option("--seeds", call->seeds, "Trainings of each variant")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  command->add_option("--episodes", call->budget.episodes, "Unseen scenes per task and training")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command
      ->add_option("--first-seed", call->budget.first_seed,
                   "The first set of scenes; each training seed has the next one")
      ->check(CLI::Range(0, 1'000'000))
      ->capture_default_str();
  command
      ->add_option("--flow-steps", call->tables.flow_steps, "Instead of the tables' own, separated by commas")
      ->delimiter(',')
      ->check(CLI::Range(1, 1000));
  command->add_flag("--paper-form", call->tables.paper_form,
                    "The publication's tables on its own parameterisation: velocity from the action token");
  command->add_option("--workers", call->workers, "Threads of episodes; more than one disturbs the times")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  command->add_flag("--list", call->list, "Only print the cells and how far each is");
  add_json_option(*command, context);
  add_egl_option(*command, context);
  set_body(*command, context, [call, &context] { return ablate(*call, context); });
}

}  // namespace flowscope::app
