// flowscope demos check: is what lies in the store whole?
#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "app/demos_command.h"

namespace flowscope::app {
namespace {

int check_demos(const Context& context) {
  int checked = 0;
  nlohmann::ordered_json bad = nlohmann::ordered_json::array();
  for (const DemoProblem& problem : open_store(context).check(&checked)) {
    std::fprintf(stderr, "%s\n", problem.problem.c_str());
    bad.push_back({{"id", problem.id}, {"problem", problem.problem}});
  }
  if (context.json) {
    print_json({{"checked", checked}, {"bad", bad}});
  } else {
    std::printf("%d checked, %zu bad\n", checked, bad.size());
  }
  return bad.empty() ? 0 : 1;
}

}  // namespace

void add_demos_check(CLI::App& demos, Context& context) {
  CLI::App* check = add_demos_part(demos, context, "check",
                                   "Verify every checksum and the content; exit code 1 when any is bad");
  set_body(*check, context, [&context] { return check_demos(context); });
}

}  // namespace flowscope::app
