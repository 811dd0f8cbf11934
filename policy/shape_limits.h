// Sizes that a file may ask for.
#pragma once

#include "policy/preset.h"

namespace flowscope {

/// Throws std::invalid_argument naming a field that is out of range: what a damaged or hostile file could
/// make us reserve is bounded here.
void require_sane(const NetworkShape& shape);

}  // namespace flowscope
