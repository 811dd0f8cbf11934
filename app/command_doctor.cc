// flowscope doctor: what is wrong with this machine, and how to mend it.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "app/cli.h"
#include "app/commands.h"
#include "app/doctor.h"

namespace flowscope::app {
namespace {

int examine(const Context& context) {
  const std::vector<DoctorCheck> checks = examine_machine(context.data);
  const bool ok = std::all_of(checks.begin(), checks.end(), [](const DoctorCheck& c) { return c.ok; });
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const DoctorCheck& check : checks) {
    nlohmann::ordered_json entry{{"name", check.name}, {"ok", check.ok}, {"found", check.found}};
    if (!check.advice.empty()) entry["advice"] = check.advice;
    list.push_back(std::move(entry));
    if (context.json) continue;
    std::printf("%-4s %-10s %s\n", check.ok ? "ok" : "BAD", check.name.c_str(), check.found.c_str());
    if (!check.advice.empty()) std::printf("                -> %s\n", check.advice.c_str());
  }
  if (context.json) print_json({{"ok", ok}, {"checks", list}});
  return ok ? 0 : 1;
}

}  // namespace

void add_doctor_command(CLI::App& root, Context& context) {
  CLI::App* command = root.add_subcommand("doctor", "Find out what this machine lacks, and how to mend it");
  add_data_option(*command, context);
  add_json_option(*command, context);
  set_body(*command, context, [&context] { return examine(context); });
}

}  // namespace flowscope::app
