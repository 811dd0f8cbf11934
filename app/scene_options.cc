#include "app/scene_options.h"

#include <CLI/CLI.hpp>

#include "recorder/instruction.h"

namespace flowscope::app {

CLI::Option* add_scene_options(CLI::App& command, SceneCall& call) {
  CLI::Option* scene =
      command.add_option("--scene", call.scene, "MJCF or URDF to open instead of a task")->type_name("FILE");
  command.add_option("--robot", call.robot, "Description of the scene's robot, or panda or ur5")
      ->type_name("FILE")
      ->needs(scene);
  command
      .add_option("--instruction", call.instruction,
                  "What is to be done in the scene; without it the words of the scene's name")
      ->type_name("TEXT")
      ->check([](const std::string& text) {
        return has_word(text) ? std::string() : "must hold a word: it is what a policy reads";
      })
      ->needs(scene);
  return scene;
}

}  // namespace flowscope::app
