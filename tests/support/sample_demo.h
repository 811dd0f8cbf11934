// A small whole demonstration made of arithmetic: no simulator, no renderer.
#pragma once

#include <cmath>
#include <string>

#include "recorder/demo.h"

namespace flowscope::testing {

inline Pose sample_pose(double step) {
  const Eigen::Vector3d axis = Eigen::Vector3d(1, 2, 3).normalized();
  return {{0.1 + 0.01 * step, -0.2, 0.9}, Eigen::Quaterniond(Eigen::AngleAxisd(0.1 * step, axis))};
}

inline View sample_view(const std::string& name, double step, int size) {
  View view;
  view.camera = CameraModel::from_vertical_fov(name, size, size, 0.8, sample_pose(step));
  view.rgb = ImageRgb(size, size);
  view.depth = DepthImage(size, size);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      for (int c = 0; c < 3; ++c) view.rgb.at(x, y)[c] = static_cast<std::uint8_t>(7 * x + 3 * y + c + step);
      // A slope, a step in the middle and a corner without a hit, as real depth pictures have.
      view.depth.at(x, y) = static_cast<float>(0.7 + 0.013 * x + 0.0003 * step + (2 * x > size ? 0.4 : 0));
    }
  }
  view.depth.at(0, 0) = 0;
  return view;
}

inline Observation sample_observation(double step, int size = 16) {
  Observation observation;
  for (const char* name : {"front", "left_shoulder", "right_shoulder", "wrist"}) {
    observation.views.push_back(sample_view(name, step, size));
  }
  return observation;
}

inline Frame sample_frame(int index) {
  Frame frame;
  frame.time_s = 0.05 * index;
  for (int joint = 0; joint < 7; ++joint) {
    frame.q[joint] = std::sin(0.3 * joint + 0.01 * index);
    frame.dq[joint] = 0.2 * std::cos(0.3 * joint + 0.01 * index);
  }
  frame.openness = index < 10 ? 1.0 : 0.25;
  frame.gripper_open = index < 10;
  frame.world_from_tool = sample_pose(index);
  SceneState& state = frame.state;
  state.scene = "push_buttons";
  state.time_s = frame.time_s;
  state.qpos.assign(frame.q.begin(), frame.q.end());
  state.qvel.assign(frame.dq.begin(), frame.dq.end());
  state.ctrl = {0.1 * index, 1.0 / 3};
  state.qacc_warmstart.assign(7, -1e-17 * index);
  state.mocap_pos = {0.1, 0.2, 0.3};
  state.mocap_quat = {1, 0, 0, 0};
  state.eq_active = {0, 1};
  state.eq_data.assign(22, 0.7);
  state.mat_rgba = {0.1f, 0.2f, 0.3f, 1};
  return frame;
}

/// 20 frames, keyframes at 10 and 19. Another `motion` has other states: a store takes each motion once.
inline Demo sample_demo(double motion = 0) {
  Demo demo;
  demo.info.task = "push_buttons";
  demo.info.variation = 3;
  demo.info.seed = 18446744073709551615u;
  demo.info.instruction = "push the red button";
  demo.instructions = {"push the red button", "press the red button"};
  demo.bounds = {{-0.3, -0.5, 0.6}, {0.7, 0.5, 1.6}};
  demo.simulator = "physics 1.0";
  for (int i = 0; i < 20; ++i) {
    demo.frames.push_back(sample_frame(i));
    demo.frames.back().state.ctrl[0] += motion;
  }
  demo.start = sample_observation(0);
  for (const int frame : {10, 19}) {
    const Frame& reached = demo.frames[frame];
    demo.keyframes.push_back({frame, {reached.world_from_tool, 0.0}, sample_observation(frame)});
  }
  demo.info.frames = 20;
  demo.info.keyframes = 2;
  return demo;
}

}  // namespace flowscope::testing
