// What a user's scene begins with: one of its key frames, or else the positions that it was written in.
#pragma once

#include <string>
#include <vector>

struct mjModel_;
struct mjData_;

namespace flowscope {

/// Parts that are empty are left as the simulator sets them.
struct StartState {
  std::vector<double> qpos, qvel, act, ctrl, mocap_pos, mocap_quat;
  /// It has velocities or activations: a moment in the middle of a movement, which nothing may pass before.
  bool moves = false;
};

/// `scene` is the model as its author wrote it, `model` what it became (with more actuators: before the
/// others where there are activations, else behind them). `key` is a key frame's name, or its number from 0;
/// empty: the first, if there is one. Throws std::runtime_error that lists the key frames.
StartState start_state(const mjModel_* scene, const mjModel_* model, const std::string& key);
void begin_with(const StartState& start, mjData_* data);

}  // namespace flowscope
