// Closed-loop success of a policy on scenes it never saw, and its error against the expert there.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "recorder/task.h"

namespace flowscope {

struct EvalOptions {
  std::filesystem::path policy;
  std::vector<std::string> tasks;
  int episodes = 25, seeds = 3, flow_steps = 4;
  int first_seed = 0;  ///< of the `seeds` sets of scenes: another one gives scenes that nobody has looked at
  int workers = 2;     ///< each has its own policy, world and renderer; only times depend on it
  std::string integrator = "euler";  ///< PredictOptions::integrator
};

struct EvalRow {
  std::string task;
  int successes = 0, first_attempts = 0, episodes = 0;
  double success = 0;           ///< fraction of all episodes
  double low = 0, high = 0;     ///< 95 % Wilson interval of it
  double first_attempt = 0;     ///< fraction done within the length of a demonstration, before starting over
  std::vector<double> by_seed;  ///< fraction per seed
  double position_mm = 0,
         rotation_deg = 0;  ///< medians against the expert's keyframes, given the expert's history
  int keyframes = 0;        ///< behind those medians; 0: they mean nothing
  int left_workspace = 0;   ///< failed episodes at whose end something had left the workspace (lost_things.h)
  double ms = 0;  ///< wall time of one prediction on the way, preparation of the scene included; mean
  std::vector<std::string> failures;  ///< one line per failed episode: seed, variation, why
};

/// Scenes come from seeds of their own, from 1 000 000 on: `record` must not be given those. Throws what
/// loading throws. `progress`: episodes done of all.
std::vector<EvalRow> evaluate(const TaskLibrary& tasks, const EvalOptions& options,
                              const std::function<void(int done, int all)>& progress);

/// Wilson's score interval of a fraction, 95 % (Wilson 1927, doi 10.1080/01621459.1927.10502953).
std::pair<double, double> wilson_interval(int successes, int trials);

/// The scene of one evaluation episode.
std::uint64_t eval_seed(int seed, int episode);
int eval_variation(int variations, int seed, int episode);

}  // namespace flowscope
