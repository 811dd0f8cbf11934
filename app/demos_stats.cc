// flowscope demos stats: how much of what a store holds.
#include <CLI/CLI.hpp>
#include <compare>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>

#include "app/demos_command.h"
#include "recorder/demo_stats.h"

namespace flowscope::app {
namespace {

using Json = nlohmann::ordered_json;

Json spread_json(const Spread& spread) {
  return {{"mean", spread.mean()}, {"min", spread.min}, {"max", spread.max}, {"sum", spread.sum}};
}

Json box_json(const Box& box) {
  const auto corner = [](const Eigen::Vector3d& p) { return Json{p.x(), p.y(), p.z()}; };
  return {{"min", corner(box.min)}, {"max", corner(box.max)}};
}

/// What belongs together: one task, robot and scene.
struct Kind {
  std::string task, robot, scene, scene_sha256;
  explicit Kind(const DemoInfo& info) : task(info.task), robot(info.origin.robot) {
    if (const auto& origin = info.origin.scene) scene = origin->scene, scene_sha256 = origin->scene_sha256;
  }
  auto operator<=>(const Kind&) const = default;
};

Json text_or_null(const std::string& text) { return text.empty() ? Json() : Json(text); }

Json task_json(const Kind& kind, const TaskStats& stats) {
  Json variations = Json::object();
  for (const auto& [variation, count] : stats.by_variation) variations[std::to_string(variation)] = count;
  return {{"task", kind.task},
          {"robot", text_or_null(kind.robot)},
          {"scene", text_or_null(kind.scene)},
          {"demos", stats.demos},
          {"unfinished", stats.unfinished},
          {"variations", variations},
          {"frames", spread_json(stats.frames)},
          {"keyframes", spread_json(stats.keyframes)},
          {"seconds", spread_json(stats.seconds)},
          {"gripper_events", spread_json(stats.gripper_events)},
          {"tool_speed_m_s", {{"mean", stats.tool_speed_m_s.mean()}, {"max", stats.tool_speed_m_s.max}}},
          {"max_joint_speed_rad_s", stats.max_joint_speed},
          {"tool_extent_m", box_json(stats.tool_extent)},
          {"bounds_m", box_json(stats.bounds)},
          {"keyframes_outside_bounds", stats.keyframes_outside},
          {"bytes", stats.bytes}};
}

void print_task(const Kind& kind, const TaskStats& stats) {
  const auto line = [](const char* what, const Spread& s, const char* unit) {
    std::printf("  %-16s mean %.1f, %.1f to %.1f%s\n", what, s.mean(), s.min, s.max, unit);
  };
  std::printf("%s: %d demonstrations of %zu variations, %.1f MB\n", kind.task.c_str(), stats.demos,
              stats.by_variation.size(), static_cast<double>(stats.bytes) / 1e6);
  std::printf("  %-16s %s%s%s\n", "robot", kind.robot.empty() ? "not recorded" : kind.robot.c_str(),
              kind.scene.empty() ? "" : ", in ", kind.scene.c_str());
  if (stats.unfinished > 0) std::printf("  %-16s %d\n", "unfinished", stats.unfinished);
  line("frames", stats.frames, "");
  line("keyframes", stats.keyframes, "");
  line("duration", stats.seconds, " s");
  line("gripper events", stats.gripper_events, "");
  std::printf("  %-16s mean %.2f, at most %.2f m/s; joints at most %.2f rad/s\n", "tool speed",
              stats.tool_speed_m_s.mean(), stats.tool_speed_m_s.max, stats.max_joint_speed);
  const Eigen::Vector3d &low = stats.tool_extent.min, &high = stats.tool_extent.max;
  std::printf("  %-16s x %.2f to %.2f, y %.2f to %.2f, z %.2f to %.2f m; %d keyframes outside the box\n",
              "tool extent", low.x(), high.x(), low.y(), high.y(), low.z(), high.z(),
              stats.keyframes_outside);
}

int stats(const Context& context) {
  const DemoStore store = open_store(context);
  std::map<Kind, TaskStats> by_kind;
  Json unreadable = Json::array();
  for (const DemoInfo& info : store.list()) {
    try {
      by_kind[Kind(info)].add(store.load_keyframes(info.id));
    } catch (const BadDemo& error) {
      std::fprintf(stderr, "%s\n", error.what());
      unreadable.push_back(info.id);
    }
  }
  std::erase_if(by_kind, [](const auto& entry) { return entry.second.demos == 0; });
  Json tasks = Json::array();
  for (const auto& [kind, its] : by_kind) {
    tasks.push_back(task_json(kind, its));
    if (!context.json) print_task(kind, its);
  }
  if (context.json) print_json({{"tasks", tasks}, {"unreadable", unreadable}});
  return 0;
}

}  // namespace

void add_demos_stats(CLI::App& demos, Context& context) {
  CLI::App* command =
      add_demos_part(demos, context, "stats",
                     "Task by task, robot by robot: how many, how long, how fast, where the tool has been");
  set_body(*command, context, [&context] { return stats(context); });
}

}  // namespace flowscope::app
