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

void add_demos_list(CLI::App& demos, Context& context);      ///< list, show
void add_demos_check(CLI::App& demos, Context& context);     ///< check
void add_demos_delete(CLI::App& demos, Context& context);    ///< delete
void add_demos_exchange(CLI::App& demos, Context& context);  ///< export, import

}  // namespace flowscope::app
