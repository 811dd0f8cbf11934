// The numbers of a demonstration as robomimic's tools expect them.
#pragma once

#include <vector>

#include "recorder/formats/export_source.h"
#include "recorder/formats/named_array.h"

namespace flowscope {

/// states, actions, actions_abs, action_dict/*, rewards, dones, obs/*, next_obs/*: all without pictures. At
/// least two frames.
std::vector<NamedArray> robomimic_samples(const Demo& demo, const ExportSource& source);

}  // namespace flowscope
