// What a policy is, in numbers: sizes, statistics, parameters and the cost of a prediction. No torch here.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "policy/cost.h"

namespace flowscope {

struct PartSummary {
  std::string name;  ///< of a module of the network
  std::int64_t parameters = 0;
  PartWork work;
};

struct PolicySummary {
  NetworkShape shape;
  RadiusSchedule radius;
  std::string preset, backbone, objective;
  Box bounds;                      ///< of the keyframes seen, metres, world; empty for a preset
  std::vector<std::string> words;  ///< of the instructions seen
  std::int64_t steps = 0;          ///< of training
  double minutes = 0;
  int demonstrations = 0;  ///< 0: not known
  std::int64_t parameters = 0;
  Work scene, step;                ///< of all parts
  std::vector<PartSummary> parts;  ///< in the order of the network
};

/// Throws BadCheckpoint naming file and place.
PolicySummary summarise_policy(const std::filesystem::path& file);
/// A policy that was never trained. Throws std::invalid_argument for an unknown preset or backbone.
PolicySummary summarise_preset(const std::string& preset, const std::string& backbone);

}  // namespace flowscope
