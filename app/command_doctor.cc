// flowscope doctor: what is wrong with this machine, and how to mend it.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/cli.h"
#include "app/commands.h"
#include "app/doctor.h"
#include "render/egl_device.h"

namespace flowscope::app {
namespace {

int examine(const DoctorCall& call, const Context& context) {
  if (!context.egl_device.empty()) ::setenv(egl_device_variable, context.egl_device.c_str(), 1);
  const std::vector<DoctorCheck> checks = examine_machine(call);
  const bool ok = std::all_of(checks.begin(), checks.end(), [](const DoctorCheck& c) { return c.ok; });
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const DoctorCheck& check : checks) {
    nlohmann::ordered_json entry{{"name", check.name}, {"ok", check.ok}, {"found", check.found}};
    if (!check.advice.empty()) entry["advice"] = check.advice;
    if (!check.all.empty()) entry["all"] = check.all;
    list.push_back(std::move(entry));
    if (context.json) continue;
    std::printf("%-4s %-10s %s\n", check.ok ? "ok" : "BAD", check.name.c_str(), check.found.c_str());
    for (const std::string& one : check.all) std::printf("                %s\n", one.c_str());
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
  add_egl_option(*command, context);
  command->parse_complete_callback([] {});  // a device that is not there is a finding here, not a wrong call
  auto call = std::make_shared<DoctorCall>();
  command->add_option("--host", call->host, "Address that serve is to listen on")->capture_default_str();
  CLI::Option* port =
      command->add_option("--port", call->port, "Port that serve is to listen on")->capture_default_str();
  set_body(*command, context, [call, port, &context] {
    call->data = context.data;
    call->port_asked = port->count() > 0;
    return examine(*call, context);
  });
}

}  // namespace flowscope::app
