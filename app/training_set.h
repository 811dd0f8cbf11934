// Which demonstrations train and which only judge.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "policy/trainer.h"
#include "recorder/demo.h"
#include "recorder/demo_check.h"
#include "recorder/demo_store.h"

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

/// Brings a store's demonstrations to a trainer, one in twenty of each task held out. What the store's own
/// check calls bad is left out, so that one damaged file ends no training.
class TrainingIntake {
 public:
  /// The store outlives this.
  explicit TrainingIntake(const DemoStore& store) : store_(store) {}
  /// What is wrong with it, with its file: then it is left out. Empty: it is learnt from now.
  std::string add(Trainer& trainer, const std::string& id);
  /// Of several in their order; what is wrong with those that are left out.
  std::vector<DemoProblem> add_all(Trainer& trainer, const std::vector<DemoInfo>& demos);
  void remove(Trainer& trainer, const std::string& id);

 private:
  const DemoStore& store_;
  DemoJudge judge_;
  std::map<std::string, std::size_t> taken_;  ///< of each task
};

}  // namespace flowscope
