// The full state of the simulated world at one moment: enough to draw it again from any camera, later.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace flowscope {

/// Plain copy of everything that changes in an episode. Sizes are those of the model it was taken from.
/// What MuJoCo 2.2 keeps in mjModel but a task changes per episode (weld on/off and its relative pose,
/// material colours) is part of it, so two states of one scene need no second model.
struct SceneState {
  std::string scene;  ///< which compiled model: the task's name
  double time_s = 0;
  std::vector<double> qpos, qvel, act, ctrl, qacc_warmstart;
  std::vector<double> mocap_pos, mocap_quat;  ///< nmocap * 3 / 4 (w,x,y,z): placed fixtures are mocap bodies
  std::vector<std::uint8_t> eq_active;        ///< neq: grasp welds
  std::vector<double> eq_data;                ///< neq * mjNEQDATA
  std::vector<float> mat_rgba;                ///< nmat * 4: the variation's colours
  bool operator==(const SceneState&) const = default;
};

}  // namespace flowscope
