// flowscope demos check: is what lies in the store whole?
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <utility>

#include "app/demos_command.h"
#include "recorder/scene_origin.h"

namespace flowscope::app {
namespace {

using Json = nlohmann::ordered_json;

/// Users' own scenes that are not as they were: their demonstrations are whole, but cannot be drawn or moved.
Json lost_scenes(const DemoStore& store) {
  std::vector<std::pair<SceneOrigin, Json>> scenes;  // few
  for (const DemoInfo& info : store.list()) {
    if (!info.origin.scene) continue;
    auto it = std::ranges::find(scenes, *info.origin.scene, &std::pair<SceneOrigin, Json>::first);
    if (it == scenes.end()) it = scenes.insert(it, {*info.origin.scene, Json::array()});
    it->second.push_back(info.id);
  }
  Json lost = Json::array();
  for (auto& [origin, ids] : scenes) {
    try {
      open_again(origin, find_assets());
    } catch (const SceneLost& error) {
      std::fprintf(stderr, "%zu demonstrations whole, but: %s\n", ids.size(), error.what());
      lost.push_back({{"file", origin.scene}, {"problem", error.what()}, {"demos", std::move(ids)}});
    }
  }
  return lost;
}

int check_demos(const Context& context) {
  int checked = 0;
  Json bad = Json::array();
  const DemoStore store = open_store(context);
  for (const DemoProblem& problem : store.check(&checked)) {
    std::fprintf(stderr, "%s\n", problem.problem.c_str());
    bad.push_back({{"id", problem.id}, {"problem", problem.problem}});
  }
  const Json lost = lost_scenes(store);
  if (context.json) {
    print_json({{"checked", checked}, {"bad", bad}, {"lost_scenes", lost}});
  } else {
    std::printf("%d checked, %zu bad\n", checked, bad.size());
  }
  return bad.empty() ? 0 : 1;
}

}  // namespace

void add_demos_check(CLI::App& demos, Context& context) {
  CLI::App* check =
      add_demos_part(demos, context, "check",
                     "Verify every checksum and the content; exit code 1 when any is bad. Names "
                     "users' own scenes that are gone or have changed, too");
  set_body(*check, context, [&context] { return check_demos(context); });
}

}  // namespace flowscope::app
