// Which demonstrations train and which only judge.
#pragma once

#include <string>

namespace flowscope {

/// One demonstration in twenty is held out for validation: those whose id ends so (ids count up per data
/// folder), the same ones for every program and every restart.
bool held_out(const std::string& demo_id);

}  // namespace flowscope
