// What the parts of `flowscope demos` share. Each part is a file of its own (demos_*.cc) that adds its
// subcommands; command_demos.cc puts them together.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "app/cli.h"
#include "recorder/demo_store.h"

namespace flowscope::app {

/// A subcommand of `demos` with --data and --json.
CLI::App* add_demos_part(CLI::App& demos, Context& context, const char* name, const char* description);

/// The store under --data. Throws UsageError when there is no such folder.
DemoStore open_store(const Context& context);

/// Runs `action`; an id that the store does not know is a wrong call.
template <typename Action>
auto with_known_id(Action&& action) {
  try {
    return std::forward<Action>(action)();
  } catch (const std::out_of_range& error) {
    throw UsageError(std::string("ID: ") + error.what());
  }
}

/// All ids first: a mistyped one must not leave half of the work done. Throws UsageError.
void require_known_ids(const DemoStore& store, const std::vector<std::string>& ids, const Context& context);

/// ID… or --all, for commands that work through several.
struct WhichDemos {
  std::vector<std::string> ids;
  bool all = false;
};
void add_which_option(CLI::App& command, WhichDemos& which);
/// Throws UsageError when neither or both were given, or an id is unknown.
std::vector<std::string> ids_of(const WhichDemos& which, const DemoStore& store, const Context& context);

/// Name of the robot, or that the file does not say.
std::string robot_text(const DemoOrigin& origin);

void add_demos_list(CLI::App& demos, Context& context);      ///< list, show
void add_demos_check(CLI::App& demos, Context& context);     ///< check
void add_demos_delete(CLI::App& demos, Context& context);    ///< delete, restore, bin
void add_demos_trim(CLI::App& demos, Context& context);      ///< trim
void add_demos_merge(CLI::App& demos, Context& context);     ///< merge
void add_demos_stats(CLI::App& demos, Context& context);     ///< stats
void add_demos_replay(CLI::App& demos, Context& context);    ///< replay
void add_demos_render(CLI::App& demos, Context& context);    ///< render
void add_demos_exchange(CLI::App& demos, Context& context);  ///< export, import

}  // namespace flowscope::app
