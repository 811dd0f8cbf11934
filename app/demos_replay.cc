// flowscope demos replay: does a demonstration still do what it did?
#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "app/demo_tasks.h"
#include "app/demos_command.h"
#include "app/sim_loop.h"
#include "recorder/demo_replay.h"

namespace flowscope::app {
namespace {

using Json = nlohmann::ordered_json;

struct ReplayCall {
  WhichDemos which;
  std::string by = "states";
  DemoScenes scenes;
};

ReplayReport replay_one(const ReplayCall& call, DemoTasks& tasks, const Demo& demo) {
  const std::shared_ptr<const Task> task = tasks.get(demo.info);
  if (call.by == "states") return replay_states(task, demo);
  if (call.by == "targets") return replay_targets(task, demo);
  return replay_actions(task, demo, [&](World& world, const GripperAction& action, const FrameSink& sink) {
    return execute_keyframe(world, action, demo.info.seed, sink);
  });
}

Json spread_json(const Spread& spread) {
  if (spread.count == 0) return nullptr;
  return {{"mean", spread.mean()}, {"max", spread.max}};
}

Json replay_json(const Demo& demo, const ReplayReport& report) {
  Json terms = Json::array();
  for (const SuccessTerm& term : report.terms) {
    terms.push_back({{"name", term.name}, {"met", term.met}, {"value", term.value}});
  }
  const Divergence& d = report.divergence;
  return {{"id", demo.info.id},
          {"task", demo.info.task},
          {"success", report.success},
          {"moments", report.moments},
          {"tool_mm", spread_json(d.tool_mm)},
          {"tool_deg", spread_json(d.tool_deg)},
          {"joint_rad", spread_json(d.joint_rad)},
          {"object_mm", spread_json(d.object_mm)},
          {"object", d.object},
          {"start_mm", report.start_mm},
          {"terms", terms},
          {"failure", report.failure},
          {"simulator", demo.simulator}};
}

void print_replay(const Demo& demo, const ReplayReport& report) {
  const Divergence& d = report.divergence;
  std::printf("%-44s %s, %d compared: tool mean %.3g, max %.3g mm; joints max %.3g rad", demo.info.id.c_str(),
              report.success ? "succeeds" : "FAILS", report.moments, d.tool_mm.mean(), d.tool_mm.max,
              d.joint_rad.max);
  if (d.object_mm.count > 0) std::printf("; objects max %.3g mm (%s)", d.object_mm.max, d.object.c_str());
  std::printf("%s%s\n", report.failure.empty() ? "" : "; ended early: ", report.failure.c_str());
  if (report.start_mm > 0.01) {
    std::printf("  the task places things up to %.3g mm from where this demonstration begins\n",
                report.start_mm);
  }
}

int replay(const ReplayCall& call, const Context& context) {
  const DemoStore store = open_store(context);
  const std::vector<std::string> ids = ids_of(call.which, store, context);
  DemoTasks tasks(call.scenes);
  Json demos = Json::array();
  int successes = 0;
  for (const std::string& id : ids) {
    try {
      const Demo demo = store.load(id);
      const ReplayReport report = replay_one(call, tasks, demo);
      successes += report.success;
      demos.push_back(replay_json(demo, report));
      if (!context.json) print_replay(demo, report);
    } catch (const BadDemo& error) {  // counts as one that fails
      std::fprintf(stderr, "%s\n", error.what());
    }
  }
  if (context.json) {
    print_json({{"by", call.by}, {"replayed", ids.size()}, {"successes", successes}, {"demos", demos}});
  } else {
    std::printf("%d of %zu succeed\n", successes, ids.size());
  }
  return successes == static_cast<int>(ids.size()) ? 0 : 1;
}

}  // namespace

void add_demos_replay(CLI::App& demos, Context& context) {
  CLI::App* command =
      add_demos_part(demos, context, "replay",
                     "Run demonstrations again and report how far they diverge; exit code 1 when one no "
                     "longer succeeds");
  auto call = std::make_shared<ReplayCall>();
  add_which_option(*command, call->which);
  command
      ->add_option(
          "--by", call->by,
          "states: restore what was recorded, exact; targets: simulate again from the joint targets; "
          "actions: carry out the keyframes with planned motions")
      ->check(CLI::IsMember({"states", "targets", "actions"}))
      ->capture_default_str();
  add_demo_scene_options(*command, call->scenes);
  set_body(*command, context, [call, &context] { return replay(*call, context); });
}

}  // namespace flowscope::app
