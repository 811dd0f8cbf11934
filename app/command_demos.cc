// flowscope demos: the demonstrations of a data folder. Its parts lie in demos_*.cc.
#include <CLI/CLI.hpp>

#include "app/commands.h"
#include "app/demos_command.h"

namespace flowscope::app {

CLI::App* add_demos_part(CLI::App& demos, Context& context, const char* name, const char* description) {
  CLI::App* command = demos.add_subcommand(name, description);
  add_data_option(*command, context);
  add_json_option(*command, context);
  return command;
}

DemoStore open_store(const Context& context) { return DemoStore(existing_data(context)); }

void require_known_ids(const DemoStore& store, const std::vector<std::string>& ids, const Context& context) {
  for (const std::string& id : ids) {
    if (!with_known_id([&] { return std::filesystem::exists(store.path(id)); })) {
      throw UsageError("ID: no demonstration \"" + id + "\" in " + context.data.string());
    }
  }
}

void add_which_option(CLI::App& command, WhichDemos& which) {
  command.add_option("ids", which.ids, "Which ones")->type_name("ID");
  command.add_flag("--all", which.all, "All of them");
}

std::vector<std::string> ids_of(const WhichDemos& which, const DemoStore& store, const Context& context) {
  if (which.all == !which.ids.empty()) throw UsageError("ID: name demonstrations, or give --all");
  require_known_ids(store, which.ids, context);
  std::vector<std::string> ids = which.ids;
  if (which.all) {
    for (const DemoInfo& info : store.list()) ids.push_back(info.id);
  }
  return ids;
}

std::string robot_text(const DemoOrigin& origin) {
  return origin.robot.empty() ? "unknown robot" : origin.robot;
}

void add_demos_command(CLI::App& root, Context& context) {
  CLI::App* demos = root.add_subcommand("demos", "Look at demonstrations and look after them");
  demos->require_subcommand(1);
  add_demos_list(*demos, context);
  add_demos_check(*demos, context);
  add_demos_delete(*demos, context);
  add_demos_exchange(*demos, context);
  add_demos_stats(*demos, context);
  add_demos_trim(*demos, context);
  add_demos_merge(*demos, context);
  add_demos_replay(*demos, context);
  add_demos_render(*demos, context);
}

}  // namespace flowscope::app
