// flowscope bench: comparisons within one run, so that the machine's mood cancels out.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "app/bench_ik.h"
#include "app/bench_plan.h"
#include "app/bench_points.h"
#include "app/bench_record.h"
#include "app/bench_stream.h"
#include "app/bench_train.h"
#include "app/cli.h"
#include "app/commands.h"
#include "policy/bench_infer.h"
#include "policy/bench_scan.h"
#include "policy/bench_tokens.h"
#include "recorder/task.h"

namespace flowscope::app {
namespace {

std::vector<BenchResult> measure(const std::string& name) {
  const auto assets = find_assets();
  if (name == "scan") return bench_scan();
  if (name == "infer") return bench_infer();
  if (name == "tokens") return bench_tokens();
  if (name == "points") return bench_points_against_pcl();
  if (name == "train") return bench_train(assets);
  if (name == "ik") return bench_ik(assets);
  if (name == "plan") return bench_plan(assets);
  const auto scratch =
      std::filesystem::temp_directory_path() / ("flowscope-bench-" + std::to_string(::getpid()));
  auto results = name == "record" ? bench_record(assets, scratch) : bench_stream(assets, scratch);
  std::filesystem::remove_all(scratch);
  return results;
}

int bench(const std::vector<std::string>& names, const Context& context) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const auto& name : names) {
    for (const BenchResult& r : measure(name)) {
      nlohmann::ordered_json entry{{"name", r.name}, {"value", r.value}, {"unit", r.unit}};
      if (r.ratio) entry["ratio"] = *r.ratio;
      if (r.against) entry["against"] = *r.against;
      list.push_back(entry);
      if (context.json) continue;
      std::printf("%-28s %12.4g %-12s", r.name.c_str(), r.value, r.unit.c_str());
      if (r.ratio) std::printf("  %.3g x %s", *r.ratio, r.against.value_or("").c_str());
      std::printf("\n");
    }
  }
  if (context.json) print_json({{"benchmarks", list}});
  return 0;
}

}  // namespace

void add_bench_command(CLI::App& root, Context& context) {
  CLI::App* command = root.add_subcommand(
      "bench", "Measure the stream, the recording, the scan, predictions and the training");
  auto names =
      std::make_shared<std::vector<std::string>>(std::vector<std::string>{"stream", "scan", "train"});
  command
      ->add_option(
          "names", *names,
          "Which: stream, scan, train (these without a name), infer (minutes), tokens, points, record, "
          "ik, plan")
      ->check(
          CLI::IsMember({"stream", "scan", "infer", "tokens", "points", "train", "record", "ik", "plan"}));
  add_json_option(*command, context);
  add_egl_option(*command, context);
  set_body(*command, context, [names, &context] { return bench(*names, context); });
}

}  // namespace flowscope::app
