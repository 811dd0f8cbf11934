// What fell off the table, or was pushed out of the arm's reach: no script and no policy gets it back.
#pragma once

#include <string>
#include <vector>

namespace flowscope {

class World;
struct SceneState;

/// A sentence for each free body that has left the workspace since `start`, a state of the same episode: 0.25
/// m farther outside the task's bounds than it was then, or 0.4 m lower.
std::vector<std::string> lost_things(const World& world, const SceneState& start);

/// The same, each after "; ": what is added to the reason of a failure.
std::string lost_text(const World& world, const SceneState& start);

}  // namespace flowscope
