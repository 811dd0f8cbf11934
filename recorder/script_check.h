// What can be known to be wrong with a script before anything moves.
#pragma once

#include <optional>
#include <string>

#include "recorder/script.h"

namespace flowscope {

class Task;

struct ScriptProblem {
  int step = -1;  ///< index of the step; -1: the script as a whole
  TextPlace place;
  std::string message;
};

/// The first of: another task than the script is for; no steps; a frame that the task's scene has not.
std::optional<ScriptProblem> find_problem(const Script& script, const Task& task);

/// Throws BadScript, "<file>:<line>:<column>: ", for the same.
void check_script(const Script& script, const Task& task);

}  // namespace flowscope
