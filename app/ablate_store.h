// The results of an ablation on disk: a folder with results.json, the tables and the trained policies.
// Whoever is killed loses the cell in work, and starting again goes on behind the last finished one.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "app/ablate_variant.h"

namespace flowscope {

/// What all cells of one folder share; results of other values must not be compared with them.
struct AblationBudget {
  std::string preset = "desk";
  std::vector<std::string> tasks;
  std::string demonstrations;  ///< SHA-256 of the ids of those that train
  double minutes = 0;          ///< of training; or
  std::int64_t steps = 0;
  int episodes = 25;   ///< per task and training seed
  int first_seed = 0;  ///< training seed s is judged on the scenes of set first_seed + s
};

struct TaskScore {
  std::string task;
  int successes = 0, episodes = 0;
  int first_attempts = 0;  ///< successes within the length of a demonstration; the others may be chance
  double position_mm = 0;  ///< median against the expert's keyframes
};

/// One policy at one number of flow steps.
struct AblationMeasure {
  int flow_steps = 0;
  std::vector<TaskScore> tasks;
  double ms = 0;        ///< wall time of one prediction, mean
  double seconds = 0;   ///< that measuring took
  std::string failure;  ///< not empty: it could not be measured, and why
};

/// One training: a variant and a seed.
struct AblationRun {
  AblationVariant variant;
  int seed = 0;
  std::string policy;  ///< file name inside the folder; empty: not trained
  std::int64_t steps = 0;
  double minutes = 0, loss = 0;
  std::string failure;  ///< not empty: training failed, and why
  std::vector<AblationMeasure> measures;
  const AblationMeasure* at(int flow_steps) const;
};

class AblationStore {
 public:
  /// Opens or begins the folder. Throws std::invalid_argument when it holds results of another budget (naming
  /// every difference) or a results.json that is none, naming file and place.
  AblationStore(std::filesystem::path folder, AblationBudget budget);
  const AblationBudget& budget() const { return budget_; }
  const std::vector<AblationRun>& runs() const { return runs_; }
  const AblationRun* find(const AblationVariant& variant, int seed) const;
  std::filesystem::path file(const std::string& name) const { return folder_ / name; }
  /// Replaces the run of the same variant and seed and writes results.json, whole or not at all.
  void put(const AblationRun& run);
  nlohmann::ordered_json document() const;

 private:
  const std::filesystem::path folder_;
  const AblationBudget budget_;
  std::vector<AblationRun> runs_;
};

}  // namespace flowscope
