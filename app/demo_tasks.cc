#include "app/demo_tasks.h"

#include <CLI/CLI.hpp>

#include "app/cli.h"

namespace flowscope::app {

void add_demo_scene_options(CLI::App& command, DemoScenes& scenes) {
  command.add_option("--tasks", scenes.folders, "Folder of further tasks")
      ->type_name("DIR")
      ->allow_extra_args(false);
  add_scene_options(command, scenes.scene);
}

DemoTasks::DemoTasks(const DemoScenes& scenes)
    : library_(find_assets(), {scenes.folders.begin(), scenes.folders.end()}) {
  if (!scenes.scene.scene.empty()) scene_ = open_scene(scenes.scene, find_assets());
}

std::shared_ptr<const Task> DemoTasks::get(const std::string& name) const {
  if (scene_ && scene_->name() == name) return scene_;
  try {
    return library_.get(name);
  } catch (const std::invalid_argument& error) {
    throw UsageError(std::string("--tasks, --scene: ") + error.what());
  }
}

}  // namespace flowscope::app
