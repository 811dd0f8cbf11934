#include "app/scene_options.h"

#include <CLI/CLI.hpp>
#include <cstdio>

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
  command.add_option("--key", call.key, "Key frame that the scene begins with, by name or number from 0")
      ->type_name("NAME")
      ->needs(scene);
  call.note = [](const std::string& text) { std::fprintf(stderr, "flowscope: %s\n", text.c_str()); };
  return scene;
}

}  // namespace flowscope::app
