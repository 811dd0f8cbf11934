// A prediction with everything that happened inside it: plain values, no torch.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "recorder/demo.h"

namespace flowscope {

using Vector9 =
    std::array<double, 9>;  ///< normalised position (3), then the first two COLUMNS of the rotation (6)

/// What the Dynamic Radius Schedule lets through at one step. Metres, world frame.
struct Region {
  Eigen::Vector3d center{0, 0, 0};
  double radius_m = 0;
  int points = 0;  ///< points of the cloud inside
  std::vector<Eigen::Vector3f>
      inside;  ///< those the network looked at (at most its token count); not on the wire by default
};

/// One state of the flow; x[k+1] = x[k] + velocity[k] * (t[k+1] - t[k]). Paper: Euler integration of dx = v
/// dt, t from 0 to 1.
struct FlowStep {
  int k = 0;
  double t = 0;  ///< 0 noise, 1 action
  Vector9 x{}, velocity{};
  Pose pose;  ///< x decoded: de-normalised position, Gram-Schmidt rotation
  Region region;
  double open_probability = 0;
  double ms = 0;  ///< wall time of this evaluation; 0 in the last entry
  std::vector<float>
      weights;  ///< what the end point rests on, per `weight_points`; sums to 1; empty for the plain form
  std::vector<Eigen::Vector3f> weight_points;  ///< metres, world
};

struct RadiusSchedule {
  std::string kind = "linear";     ///< linear, cosine, off
  double r_0 = 0.4, r_min = 0.06;  ///< metres, world; unpublished, ours
  /// Paper §3.3: r = (1 - t)(r_0 - r_min) + r_min; cosine anneals with the same ends; off: infinite is drawn
  /// as r_0.
  double radius_m(double t) const;
};

struct TraceScene {
  std::string task;
  int variation = 0;
  std::uint64_t seed = 0;
  std::optional<std::string> demo;
  std::optional<int> keyframe;
  std::string state_sha256;
};

struct PoseError {
  double position_m = 0, rotation_deg = 0;
  bool open_correct = false;
};

struct FlowTrace {
  std::string id, created;
  std::string policy_file, weights_sha256, backbone = "mamba", objective = "cfm", integrator = "euler";
  std::uint64_t generation = 0;  ///< optimiser steps behind the weights
  RadiusSchedule radius;
  int flow_steps = 4;
  std::uint64_t seed = 0;
  TraceScene scene;
  std::string instruction;
  std::vector<FlowStep> steps;  ///< flow_steps + 1 entries
  GripperAction result;
  std::optional<GripperAction> expert;
  std::optional<PoseError> error;
  struct Parent {
    std::string trace;
    int step = 0;
  };
  std::optional<Parent> parent;
};

/// Fills trace.error from result and expert.
void compare_with_expert(FlowTrace& trace, const GripperAction& expert);

}  // namespace flowscope
