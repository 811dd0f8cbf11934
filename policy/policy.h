// The seam between a policy and everything that uses one. No torch here.
#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "policy/flow_trace.h"

namespace flowscope {

struct PolicyInput {
  Observation observation;
  std::string instruction;
  std::vector<RobotState>
      history;             ///< oldest first, last is now; at least one; the policy takes the last three
  int keyframe_index = 0;  ///< how many keyframes lie behind
  std::string robot;       ///< its name; empty: not known
};

struct PredictOptions {
  int flow_steps = 4;
  std::uint64_t seed = 0;
  std::optional<std::string> radius_kind;  ///< overrides the schedule's kind
  std::string integrator = "euler";        ///< euler, midpoint, rk4; diffusion takes its own steps only
  /// Run on from an edited state: steps before it are copied from `from`.
  struct Branch {
    const FlowTrace* from = nullptr;
    int step = 0;
    std::optional<Eigen::Vector3d> position;  ///< metres, world
    std::optional<Eigen::Quaterniond> rotation;
    std::optional<double> radius_m;  ///< held from this step on
  };
  std::optional<Branch> branch;
};

/// Predictions under way, which may be left off after any flow step and taken up again, or given up. How they
/// are cut into slices changes no bit. On the thread of the policy, which must outlive it and neither learn
/// nor be trained meanwhile.
class Prediction {
 public:
  virtual ~Prediction() = default;
  /// Goes on for about that long, at least by one flow step; false when all is done.
  virtual bool advance(std::chrono::milliseconds slice) = 0;
  /// Flow steps that are still to come.
  virtual std::size_t left() const = 0;
  /// Once, after advance() has said false.
  virtual std::vector<FlowTrace> take() = 0;
};

/// One thread at a time (the policy thread). Throws std::invalid_argument for an input that does not fit.
class Policy {
 public:
  virtual ~Policy() = default;
  /// `count` predictions of one scene with the seeds seed, seed + 1, …, each the same as predict's with its
  /// seed. A branch keeps the noise that it has: one sample. What `options` points to must live as long.
  virtual std::unique_ptr<Prediction> begin(const PolicyInput& input, const PredictOptions& options,
                                            int count) = 0;
  /// The same, to the end.
  std::vector<FlowTrace> predict_samples(const PolicyInput& input, const PredictOptions& options, int count);
  /// Same weights, input, options and machine: the same numbers, bit for bit. Scene and expert fields are the
  /// caller's to fill.
  FlowTrace predict(const PolicyInput& input, const PredictOptions& options);
  /// Optimiser steps behind the weights.
  virtual std::uint64_t generation() const = 0;
  /// Name of the robot whose joints it learnt; empty: not known. An input of another one does not fit.
  virtual std::string robot() const = 0;
};

/// A file that is not one of our checkpoints, or is cut or damaged; what() names file and place.
class BadCheckpoint : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Reads a checkpoint for prediction only.
std::unique_ptr<Policy> load_policy(const std::filesystem::path& file);

}  // namespace flowscope
