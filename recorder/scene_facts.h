// What other programs want to know of a compiled scene.
#pragma once

#include <string>
#include <vector>

#include "render/scene_state.h"

struct mjModel_;

namespace flowscope {

/// Whether all parts of the state have the model's sizes.
bool is_state_of(const mjModel_* model, const SceneState& state);

/// Everything that moves and is not the robot: the coordinates of all other joints in the model's order (a
/// free body: position, quaternion w,x,y,z), then the positions of placed bodies, then their quaternions.
/// Metres, radians. Throws std::invalid_argument when the state is of another model.
/// `tool` is the robot's site; empty: there is no robot.
std::vector<double> object_state(const mjModel_* model, const std::string& tool, const SceneState& state);

/// The scene as one MJCF text, everything included. MuJoCo keeps only what it compiled last, so call this
/// right after `model` was loaded. Throws std::runtime_error with its reason.
std::string mjcf_of_last_loaded(const mjModel_* model);

}  // namespace flowscope
