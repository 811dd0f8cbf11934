// Plausible values: what a prediction, a demonstration and a training run look like.
#pragma once

#include <cmath>
#include <cstdint>
#include <random>
#include <string>

#include "web/backend.h"

namespace flowscope::testing {

/// A flow from noise to the same action for every seed; the region shrinks linearly and grows fuller.
inline FlowTrace fake_trace(const std::string& id, int flow_steps, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const Vector9 action{0.1, -0.2, 0.3, 1, 0, 0, 0, -1, 0};
  FlowTrace trace;
  trace.id = id;
  trace.created = "2026-01-02T03:04:05Z";
  trace.policy_file = "policies/live.fsp";
  trace.weights_sha256 = std::string(64, 'a');
  trace.generation = 1240;
  trace.flow_steps = flow_steps;
  trace.seed = seed;
  trace.scene = {"push_buttons", 0, 7, std::nullopt, std::nullopt, std::string(64, 'b')};
  trace.instruction = "push the red button, then the blue button";
  Vector9 noise{};
  for (double& value : noise) value = normal(random);
  for (int k = 0; k <= flow_steps; ++k) {
    FlowStep step;
    step.k = k;
    step.t = static_cast<double>(k) / flow_steps;
    for (std::size_t i = 0; i < 9; ++i) {
      step.x[i] = noise[i] + step.t * (action[i] - noise[i]);
      step.velocity[i] = action[i] - noise[i];
    }
    step.pose.position = {0.3 + 0.2 * step.x[0], 0.3 * step.x[1], 0.95 + 0.2 * step.x[2]};
    step.pose.rotation = Eigen::Quaterniond(0, std::cos(0.4 * (1 - step.t)), std::sin(0.4 * (1 - step.t)), 0);
    step.region.center = step.pose.position;
    step.region.radius_m = (1 - step.t) * (trace.radius.r_0 - trace.radius.r_min) + trace.radius.r_min;
    step.region.points = static_cast<int>(4000 * step.region.radius_m);
    step.open_probability = 0.5 - 0.45 * step.t;
    step.ms = k == flow_steps ? 0 : (k == 0 ? 31.5 : 4.25);
    for (int i = 0; i < 100; ++i) {
      step.weights.push_back(static_cast<float>(std::exp(-0.05 * i) * 0.05));
      const auto angle = static_cast<float>(0.3 * i);
      step.weight_points.push_back(
          step.pose.position.cast<float>() +
          0.03f * Eigen::Vector3f(std::cos(angle), std::sin(angle), 0.02f * static_cast<float>(i)));
    }
    trace.steps.push_back(step);
  }
  trace.result = {trace.steps.back().pose, 0};
  trace.expert = trace.result;
  trace.expert->world_from_tool.position.x() += 0.012;
  trace.error = PoseError{0.012, 3.5, true};
  return trace;
}

inline Demo fake_demo(const std::string& id, std::uint64_t seed) {
  Demo demo;
  demo.info = {id,
               "push_buttons",
               0,
               seed,
               "push the red button, then the blue button",
               "2026-01-02T03:04:05Z",
               120,
               3,
               1843200,
               {"panda", 7, {}},
               true};
  demo.instructions = {demo.info.instruction, "press red, then blue"};
  demo.bounds = {{-0.1, -0.5, 0.75}, {0.6, 0.5, 1.4}};
  for (int i = 0; i < demo.info.frames; ++i) {
    Frame frame;
    frame.time_s = 0.05 * i;
    demo.frames.push_back(frame);
  }
  for (const char* name : {"front", "left_shoulder", "right_shoulder", "wrist"}) {
    View view;
    view.camera.name = name;
    demo.start.views.push_back(view);
  }
  for (int k = 0; k < demo.info.keyframes; ++k) {
    Keyframe keyframe;
    keyframe.frame = 39 * (k + 1);
    keyframe.action.world_from_tool = Pose::from_wxyz({0.2 + 0.05 * k, 0.1 * k, 0.9}, {0, 1, 0, 0});
    keyframe.action.openness = k == 1 ? 0 : 1;
    demo.keyframes.push_back(keyframe);
  }
  return demo;
}

inline void advance_training(web::TrainReport& report) {
  TrainStatus& status = report.status;
  status.step += 4;
  const auto step = static_cast<double>(status.step);
  status.loss_flow = 0.9 * std::exp(-step / 400) + 0.05 + 0.02 * std::sin(0.7 * step);
  status.loss_open = 0.3 * std::exp(-step / 200);
  status.loss = status.loss_flow + status.loss_open;
  status.samples_per_s = 210 + 10 * std::sin(step);
  status.minutes += 0.01;
  status.demos = 2;
  report.loss_history.emplace_back(status.step, status.loss);
  if (report.loss_history.size() > 1000) report.loss_history.erase(report.loss_history.begin());
  if (status.step % 100 == 0) {
    status.validation = {80 * std::exp(-step / 500) + 6, 20 * std::exp(-step / 500) + 1.5, 6};
    report.validation_history.emplace_back(status.step, status.validation.position_mm,
                                           status.validation.rotation_deg);
  }
}

}  // namespace flowscope::testing
