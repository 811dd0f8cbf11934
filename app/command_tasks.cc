// flowscope tasks: which tasks there are, with their variations and instructions.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "app/cli.h"
#include "app/commands.h"
#include "recorder/task.h"

namespace flowscope::app {
namespace {

int print_tasks(bool json) {
  const TaskLibrary library(find_assets());
  nlohmann::ordered_json tasks = nlohmann::ordered_json::array();
  for (const std::string& name : library.names()) {
    const std::shared_ptr<const Task> task = library.get(name);
    nlohmann::ordered_json instructions = nlohmann::ordered_json::array();
    for (int variation = 0; variation < task->variations(); ++variation) {
      instructions.push_back(task->instructions(variation).front());
    }
    if (!json) {
      std::printf("%-32s %3d variation%s  %s\n", name.c_str(), task->variations(),
                  task->variations() == 1 ? " " : "s", task->instructions(0).front().c_str());
    }
    tasks.push_back({{"name", name}, {"variations", task->variations()}, {"instructions", instructions}});
  }
  if (json) print_json({{"tasks", tasks}});
  return 0;
}

}  // namespace

void add_tasks_command(CLI::App& root, Context& context) {
  CLI::App* command = root.add_subcommand("tasks", "List the tasks, their variations and instructions");
  add_json_option(*command, context);
  set_body(*command, context, [&context] { return print_tasks(context.json); });
}

}  // namespace flowscope::app
