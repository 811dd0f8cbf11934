// Which demonstrations train and which only judge.
#pragma once

#include <cstddef>

namespace flowscope {

/// One demonstration in twenty is held out for validation: the tenth of every twenty of a task, in the order
/// of the store. `position` counts a task's demonstrations from 0.
bool held_out(std::size_t position);

}  // namespace flowscope
