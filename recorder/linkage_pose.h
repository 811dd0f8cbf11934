// Linkages that equality constraints close, posed without physics.
#pragma once

#include <vector>

struct mjModel_;
struct mjData_;

namespace flowscope {

/// Moves hinges and slides below `body` that are not `fixed` (by joint) so that `connect`, `weld` and the
/// other active equalities hold again, as nearly as they can: as little as possible, from where they are.
/// What is satisfied already stays. Leaves positions up to date, constraints and velocities undefined.
void close_linkages(const mjModel_* model, mjData_* data, int body, const std::vector<bool>& fixed);

}  // namespace flowscope
