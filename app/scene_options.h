// --scene FILE, --robot FILE, --instruction TEXT and --key NAME: a user's own scene in place of a task.
#pragma once

#include "recorder/scene_task.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace flowscope::app {

/// Worded the same in every command that has them; returns --scene.
CLI::Option* add_scene_options(CLI::App& command, SceneCall& call);

}  // namespace flowscope::app
