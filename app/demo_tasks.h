// The scenes that stored demonstrations belong to.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/scene_options.h"
#include "recorder/demo.h"
#include "recorder/task.h"

namespace flowscope::app {

/// --tasks DIR, --scene FILE, --robot FILE: what a command needs that draws or moves what was recorded.
struct DemoScenes {
  std::vector<std::string> folders;
  SceneCall scene;
};
void add_demo_scene_options(CLI::App& command, DemoScenes& scenes);

/// The known tasks, those of further folders, and users' own scenes: the one of the call before the ones that
/// demonstrations name.
class DemoTasks {
 public:
  explicit DemoTasks(const DemoScenes& scenes);
  /// What `info` was recorded in, as it was then. Throws UsageError that says what is missing or has changed,
  /// and names the options.
  std::shared_ptr<const Task> get(const DemoInfo& info);

 private:
  std::shared_ptr<const Task> recorded_scene(const DemoInfo& info);
  std::shared_ptr<const Task> installed_task(const DemoInfo& info) const;

  TaskLibrary library_;
  std::shared_ptr<const Task> scene_;  ///< null without --scene
  /// The last one that a demonstration named: those of a store mostly come scene by scene.
  std::optional<std::pair<SceneOrigin, std::shared_ptr<const Task>>> recorded_;
};

}  // namespace flowscope::app
