// Which demonstrations train and which only judge.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "recorder/demo.h"

namespace flowscope {

/// One demonstration in twenty is held out for validation: the tenth of every twenty of a task, in the order
/// of the store. `position` counts a task's demonstrations from 0.
bool held_out(std::size_t position);

/// What is learnt from together.
struct TrainingChoice {
  std::vector<DemoInfo> demos;  ///< in the order of the store
  std::string robot;            ///< theirs; empty: no file says
  int unfinished = 0;           ///< of the wanted tasks, left out
};

/// The demonstrations of `tasks` (empty: all), those that do not succeed only if `unfinished`. A policy
/// learns the joints of one robot: throws std::invalid_argument that names the robots and their tasks when
/// there are several. Files that do not name their robot go with any.
TrainingChoice choose_training(const std::vector<DemoInfo>& stored, const std::vector<std::string>& tasks,
                               bool unfinished);

}  // namespace flowscope
