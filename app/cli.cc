#include "app/cli.h"

#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string_view>
#include <system_error>

#include "app/commands.h"
#include "policy/policy.h"
#include "recorder/demo_store.h"
#include "recorder/script.h"
#include "render/egl_device.h"
#include "render/renderer.h"

namespace flowscope::app {
namespace {

/// --flow-steps is also FLOWSCOPE_FLOW_STEPS: one rule for every option of every command.
void name_environment_twins(CLI::App& command) {
  for (CLI::Option* option : command.get_options()) {
    if (option->get_lnames().empty() || option == command.get_help_ptr()) continue;
    std::string name = "FLOWSCOPE_" + option->get_lnames().front();
    std::transform(name.begin(), name.end(), name.begin(),
                   [](unsigned char c) { return c == '-' ? '_' : static_cast<char>(std::toupper(c)); });
    option->envname(name);
  }
}

/// Only the commands that were called: the parser would read the twins of all others too, and they share
/// their values.
void name_environment_twins_of_call(CLI::App& root, int argc, const char* const* argv) {
  CLI::App* command = &root;
  for (int i = 1; i < argc; ++i) {
    const auto subs = command->get_subcommands([&](CLI::App* sub) { return sub->check_name(argv[i]); });
    if (subs.empty()) return;
    command = subs.front();
    name_environment_twins(*command);
  }
}

/// The parser itself would only say that a command is missing.
void require_known_command(const CLI::App& root, int argc, const char* const* argv) {
  if (argc < 2 || argv[1][0] == '-') return;
  const std::vector<const CLI::App*> known =
      root.get_subcommands([&](const CLI::App* command) { return command->check_name(argv[1]); });
  if (!known.empty()) return;
  throw CLI::ParseError(std::string("no command is called ") + argv[1], CLI::ExitCodes::ExtrasError);
}

int fail(int code, const std::string& message, bool json) {
  std::cerr << "flowscope: " << message << "\n";
  if (json) {
    print_json({{"error", {{"code", code == 2 ? "bad_call" : "failed"}, {"message", message}}}});
  }
  return code;
}

/// Standard output may be a file on a full disk: what was printed there has to arrive. A reader that has
/// gone away has had enough of it.
void require_printed() {
  std::cout.flush();
  const bool flushed = std::fflush(stdout) == 0;
  const int error = errno;
  if (flushed && std::ferror(stdout) == 0 && std::cout.good()) return;
  pollfd out{STDOUT_FILENO, 0, 0};
  if (error == EPIPE || (::poll(&out, 1, 0) == 1 && (out.revents & POLLERR) != 0)) return;
  std::cout.clear();
  throw std::system_error(flushed ? EIO : error, std::generic_category(), "cannot write standard output");
}

/// Before any thread is there, and before a command has done half of its work.
void choose_egl_device(const Context& context) {
  if (!context.draws) return;
  if (!context.egl_device.empty()) ::setenv(egl_device_variable, context.egl_device.c_str(), 1);
  if (chosen_egl_device()) probe_egl();
}

int run_body(const Context& context) {
  try {
    choose_egl_device(context);
    const int code = context.body();
    require_printed();
    return code;
  } catch (const UsageError& error) {
    return fail(2, error.what(), context.json);
  } catch (const BadScript& error) {
    return fail(2, error.what(), context.json);
  } catch (const BadDemo& error) {
    return fail(2, error.what(), context.json);
  } catch (const BadCheckpoint& error) {
    return fail(2, error.what(), context.json);
  } catch (const BadEglDevice& error) {
    return fail(2, error.what(), context.json);
  } catch (const std::exception& error) {
    return fail(1, error.what(), context.json);
  }
}

}  // namespace

CLI::Option* add_json_option(CLI::App& command, Context& context) {
  return command.add_flag("--json", context.json, "Print exactly one JSON document on stdout");
}

CLI::Option* add_data_option(CLI::App& command, Context& context) {
  return command.add_option("--data", context.data, "Folder of demonstrations, policies, traces and exports")
      ->type_name("DIR")
      ->capture_default_str();
}

void add_egl_option(CLI::App& command, Context& context) {
  command
      .add_option("--egl-device", context.egl_device,
                  "Number of the EGL device that draws (flowscope doctor lists them); by default that of "
                  "MUJOCO_EGL_DEVICE_ID or EGL_DEVICE_ID, else the first that can")
      ->type_name("N");
  command.parse_complete_callback([&context] { context.draws = true; });
}

const std::filesystem::path& existing_data(const Context& context) {
  if (!std::filesystem::is_directory(context.data)) {
    throw UsageError("--data: no folder " + context.data.string());
  }
  return context.data;
}

void set_body(CLI::App& command, Context& context, std::function<int()> body) {
  command.callback([&context, body = std::move(body)] { context.body = body; });
}

void print_json(const nlohmann::ordered_json& document) {
  std::cout << document.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) << std::endl;
}

int run_cli(int argc, const char* const* argv) {
  // A reader that goes away is an error of a write, not the end of the program.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);  // so is a file that grows above `ulimit -f`
  Context context;
  CLI::App root("flowscope: a headless debugger for flow-matching manipulation policies", "flowscope");
  root.require_subcommand(1);
  root.set_version_flag("--version", "flowscope 0.1.0");
  add_tasks_command(root, context);
  add_record_command(root, context);
  add_demos_command(root, context);
  add_doctor_command(root, context);
  add_train_command(root, context);
  add_predict_command(root, context);
  add_eval_command(root, context);
  add_ablate_command(root, context);
  add_policy_command(root, context);
  add_export_command(root, context);
  add_scene_command(root, context);
  add_serve_command(root, context);
  add_bench_command(root, context);
  name_environment_twins_of_call(root, argc, argv);
  try {
    require_known_command(root, argc, argv);
    root.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return root.exit(error);  // --help, --version
    const bool json = std::any_of(argv, argv + argc, [](std::string_view a) { return a == "--json"; });
    return fail(2, std::string(error.what()) + " (see flowscope --help)", json);
  }
  return run_body(context);
}

}  // namespace flowscope::app
