// flowscope tasks: which tasks there are, with their variations and instructions.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "app/cli.h"
#include "app/commands.h"
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

}  // namespace

void add_tasks_command(CLI::App& root, Context& context) {
  CLI::App* command = root.add_subcommand("tasks", "List the tasks, their variations and instructions");
  auto folders = std::make_shared<std::vector<std::string>>();
  command->add_option("--tasks", *folders, "Folder of further tasks")
      ->type_name("DIR")
      ->allow_extra_args(false);
  add_json_option(*command, context);
  set_body(*command, context, [folders, &context] { return list_tasks(*folders, context.json); });
}

}  // namespace flowscope::app
