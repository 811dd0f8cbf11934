// Two files of one motion: it would weigh double, and one could train while the other judges.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "recorder/demo.h"

namespace flowscope {

/// Fingerprint of task, frames and states: two scenes may lead an arm in the same way. Throws
/// std::invalid_argument like pack_states (demo_states.h).
std::string motion_sha256(const Demo& demo);

/// The first of `files` whose task, frames and states are those of `demo`, which has some. Files that cannot
/// be read hold none. Looks at one frame of each file, and at more only where that is the same.
std::optional<std::filesystem::path> find_twin(const Demo& demo,
                                               const std::vector<std::filesystem::path>& files);

/// How a twin is told.
std::string twin_text(const std::string& id_of_first);

}  // namespace flowscope
