// Which variations a task has and what an episode draws by lot: both end as names for placeholders.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "recorder/task_random.h"
#include "recorder/task_tree.h"

namespace flowscope {

/// The 20 colour words of the benchmark, in its order.
const std::vector<std::string>& color_names();
/// Linear RGB in [0, 1] of a colour word; throws std::invalid_argument for any other word.
std::array<float, 3> color_rgb(const std::string& name);

/// `variations:` as the list of what each variation binds. `combine` is an odometer: its last entry turns
/// fastest, and `limit` cuts the list.
std::vector<Variables> read_variations(const TaskReader& reader, const std::string& task,
                                       const TaskNode& node);

/// `draw:` (may be null): adds what this episode draws to its variation's variables.
void draw_variables(const TaskReader& reader, const TaskNode* node, TaskRandom& random, Variables& variables);

}  // namespace flowscope
