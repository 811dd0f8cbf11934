// MuJoCo's own error handler waits for a key and exits; its warning handler writes a log file into the
// working folder. Neither may happen inside a server.
#pragma once

#include <string>

namespace flowscope {

/// From now on an engine error throws std::runtime_error out of the MuJoCo call (discard the mjData it worked
/// on), and a warning goes to stderr, at most once per second and text. Any thread, any number of times.
void install_mujoco_guard();

/// The newest warning raised on this thread since the last call, which clears it; empty when there was none.
std::string take_mujoco_warning();

}  // namespace flowscope
