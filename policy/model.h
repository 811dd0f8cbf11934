// A network together with all that an input must go through on its way into it.
#pragma once

#include <memory>
#include <string>

#include "policy/network.h"
#include "policy/objective.h"

namespace flowscope {

struct Model {
  NetworkShape shape;
  RadiusSchedule radius;
  std::string backbone = "mamba", objective_name = "cfm";
  std::unique_ptr<Objective> objective;
  Vocabulary vocabulary;
  Box bounds;  ///< union over the tasks, metres, world
  PositionScale scale;
  FlowRamNetwork network{nullptr};
};

/// Fresh weights from `seed`. Throws std::invalid_argument for an unknown backbone or objective.
Model make_model(const NetworkShape& shape, const RadiusSchedule& radius, const std::string& backbone,
                 const std::string& objective, std::uint64_t seed);

}  // namespace flowscope
