// A network together with all that an input must go through on its way into it.
#pragma once

#include <memory>
#include <string>

#include "policy/clip/weights.h"
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
  std::shared_ptr<const ClipEncoders> clip;  ///< where a branch of the shape is "clip"
};

/// Fresh weights from `seed`. Throws std::invalid_argument for an unknown backbone or objective.
Model make_model(const NetworkShape& shape, const RadiusSchedule& radius, const std::string& backbone,
                 const std::string& objective, std::uint64_t seed,
                 std::shared_ptr<const ClipEncoders> clip = nullptr);

/// The encoders that a shape asks for, from `file`, or where that is empty from FLOWSCOPE_CLIP; null when it
/// asks for none. Throws BadCheckpoint for a bad file, std::invalid_argument when none is named.
std::shared_ptr<const ClipEncoders> clip_for(const NetworkShape& shape, const std::string& file);

}  // namespace flowscope
