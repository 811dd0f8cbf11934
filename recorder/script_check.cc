#include "recorder/script_check.h"

#include "recorder/task.h"
#include "recorder/task_placement.h"

namespace flowscope {

std::optional<ScriptProblem> find_problem(const Script& script, const Task& task) {
  if (!script.task.empty() && script.task != task.name()) {
    return ScriptProblem{-1, script.task_place,
                         "the script is for task '" + script.task + "', the scene is '" + task.name() + "'"};
  }
  if (script.steps.empty())
    return ScriptProblem{-1, {}, "the scene has no demonstration of its own: write a script"};
  for (std::size_t i = 0; i < script.steps.size(); ++i) {
    const auto* move = std::get_if<MoveStep>(&script.steps[i].what);
    if (!move || has_frame(task.model(), move->frame)) continue;
    return ScriptProblem{static_cast<int>(i), move->frame_place,
                         unknown_frame_text(task.model(), move->frame)};
  }
  return std::nullopt;
}

void check_script(const Script& script, const Task& task) {
  const auto problem = find_problem(script, task);
  if (!problem) return;
  std::string place = script.file + ":";
  if (problem->place.line > 0)
    place += std::to_string(problem->place.line) + ":" + std::to_string(problem->place.column) + ":";
  throw BadScript(place + " " + problem->message);
}

}  // namespace flowscope
