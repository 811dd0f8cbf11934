// The frame of the command line: what every command shares. Exit codes: 0 done, 1 failed, 2 wrong call or
// input file.
#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <stdexcept>
#include <string>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace flowscope::app {

/// A wrong call or input file (exit code 2); what() names the option, or file:line:column.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What a run of the program carries from the parsed call to the command's body.
struct Context {
  bool json = false;                              ///< --json was given
  std::filesystem::path data = "flowscope-data";  ///< --data
  std::string egl_device;                         ///< --egl-device, as given
  bool draws = false;                             ///< the chosen command takes --egl-device
  std::function<int()> body;                      ///< set by the chosen command; returns the exit code
};

/// --json and --data DIR, worded the same in every command that has them.
CLI::Option* add_json_option(CLI::App& command, Context& context);
CLI::Option* add_data_option(CLI::App& command, Context& context);
/// --egl-device N, for every command that draws; a device that is not there is a wrong call.
void add_egl_option(CLI::App& command, Context& context);
/// --data of a command that only reads: looking at a mistyped folder must not create it. Throws UsageError.
const std::filesystem::path& existing_data(const Context& context);
/// Runs `body` after the whole call has been read; what it throws becomes an exit code and a message.
void set_body(CLI::App& command, Context& context, std::function<int()> body);

/// The one JSON document on stdout.
void print_json(const nlohmann::ordered_json& document);

/// Parses the call, runs the command, returns the exit code. Never throws.
int run_cli(int argc, const char* const* argv);

}  // namespace flowscope::app
