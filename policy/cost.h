// What a prediction costs, part by part of the network, from its sizes alone.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "policy/preset.h"

namespace flowscope {

/// Multiply-adds of one scene (batch 1).
struct Work {
  std::int64_t products = 0;     ///< in matrix products, attention's included
  std::int64_t recurrences = 0;  ///< in Mamba's convolution and scan: 4 per channel, 3 per channel and state
  Work& operator+=(const Work& other);
};

struct PartWork {
  Work scene;  ///< once per observation
  Work step;   ///< at each evaluation: a prediction of k Euler steps takes k + 1, the last for the gripper
};

/// By the names of FlowRamNetwork's modules (network.h); parts that only look up or normalise are left out.
/// Of CLIP's branches only what learns on the text is counted: the frozen encoders and the pyramid depend on
/// the pictures. Throws std::invalid_argument for an unknown backbone.
std::map<std::string, PartWork> cost_of(const NetworkShape& shape, const std::string& backbone);

}  // namespace flowscope
