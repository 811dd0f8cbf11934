#include "app/demo_tasks.h"

#include <CLI/CLI.hpp>

#include "app/cli.h"
#include "recorder/scene_origin.h"

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

std::shared_ptr<const Task> DemoTasks::get(const DemoInfo& info) {
  if (scene_ && scene_->name() == info.task) return scene_;
  return info.origin.scene ? recorded_scene(info) : installed_task(info);
}

std::shared_ptr<const Task> DemoTasks::recorded_scene(const DemoInfo& info) {
  const SceneOrigin& origin = *info.origin.scene;
  if (!recorded_ || recorded_->first != origin) {
    try {
      recorded_.emplace(origin, open_again(origin, find_assets()));
    } catch (const SceneLost& error) {
      throw UsageError(info.id + ": " + error.what() + "; --scene FILE --robot FILE opens a file called " +
                       info.task + " in its place");
    }
  }
  return recorded_->second;
}

std::shared_ptr<const Task> DemoTasks::installed_task(const DemoInfo& info) const {
  std::shared_ptr<const Task> task;
  try {
    task = library_.get(info.task);
  } catch (const std::invalid_argument& error) {
    const bool old = info.origin.robot.empty();  // such files do not name a user's own scene
    throw UsageError(info.id + ": --tasks" + (old ? ", --scene: " : ": ") + error.what());
  }
  const std::string &then = info.origin.robot, &now = task->robot().name;
  if (!then.empty() && then != now) {
    throw UsageError(info.id + ": was recorded with the robot " + then + ", but the task " + info.task +
                     " has " + now);
  }
  return task;
}

}  // namespace flowscope::app
