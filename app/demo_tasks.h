// The scenes that stored demonstrations belong to.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "app/scene_options.h"
#include "recorder/task.h"

namespace flowscope::app {

/// --tasks DIR, --scene FILE, --robot FILE: what a command needs that draws or moves what was recorded.
struct DemoScenes {
  std::vector<std::string> folders;
  SceneCall scene;
};
void add_demo_scene_options(CLI::App& command, DemoScenes& scenes);

/// The known tasks, those of further folders, and the user's own scene.
class DemoTasks {
 public:
  explicit DemoTasks(const DemoScenes& scenes);
  /// By DemoInfo::task. Throws UsageError that names the options.
  std::shared_ptr<const Task> get(const std::string& name) const;

 private:
  TaskLibrary library_;
  std::shared_ptr<const Task> scene_;  ///< null without --scene
};

}  // namespace flowscope::app
