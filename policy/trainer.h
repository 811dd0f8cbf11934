// Training that can stop after any step, take in a new demonstration, predict, and go on.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "policy/augmentation.h"
#include "policy/exchange.h"
#include "policy/policy.h"
#include "recorder/demo.h"

namespace flowscope {

struct TrainOptions {
  std::string preset = "desk";  ///< assets/policies/<preset>.yaml
  std::string objective = "cfm", backbone = "mamba";
  std::string radius = "linear";
  std::string times;  ///< training times of flow matching; empty: the preset's
  bool point_encoder = true;
  bool grounded = true;      ///< false: the paper's own form (velocity straight from the action token)
  bool binding = true;       ///< every point sees how well it matches each word before anything is pooled
  bool part_middles = true;  ///< small parts have one middle, their outline's
  Augmentation augment;
  std::string image_branch, text_branch;  ///< patches or clip, words or clip; empty: the preset's
  std::string clip;                       ///< file of CLIP's converted weights; empty: FLOWSCOPE_CLIP
  int scenes = 0;                         ///< observations per optimiser step and process; 0: the preset's
  std::string device = "cpu";             ///< cpu, cuda, cuda:1, …; not stored
  std::uint64_t seed = 0;
  double expected_minutes = 0;  ///< > 0: the learning-rate schedule ends there
  std::int64_t expected_steps =
      0;              ///< > 0, without minutes: it ends there, and a run can be repeated exactly
  std::string robot;  ///< whose demonstrations these are; empty: the first one that names its robot says so
};

/// Medians over the held-out keyframes of one task.
struct TaskError {
  std::string task;
  double position_mm = 0, rotation_deg = 0;
  int keyframes = 0;
};

struct Validation {
  double position_mm = 0, rotation_deg = 0;  ///< medians against held-out expert keyframes
  int keyframes = 0;                         ///< 0: nothing held out
  std::vector<TaskError> tasks = {};         ///< by name
};

struct TrainStatus {
  std::int64_t step = 0;
  double loss = 0, loss_flow = 0, loss_open = 0;
  double samples_per_s = 0, minutes = 0;
  int demos = 0;
  Validation validation;
  double loss_position = 0, loss_rotation = 0;  ///< the two parts of loss_flow, each per number
  std::int64_t skipped = 0;  ///< steps whose loss or gradient was not finite: they changed nothing
};

/// Owns network, optimiser, EMA copy and random state. One thread (the policy thread).
class Trainer : public Policy {
 public:
  /// Fresh weights; statistics (bounds) come from the demonstrations added before the first step and are
  /// stored with the weights. With an `exchange` of several processes every process makes the same calls with
  /// the same demonstrations; each learns from its own `scenes` of a batch that is `size` times as large.
  /// Throws std::invalid_argument.
  static std::unique_ptr<Trainer> create(const TrainOptions& options,
                                         std::shared_ptr<GradientExchange> exchange = nullptr);
  /// Goes on exactly where `save` stopped: weights, moments, EMA, random state, step. Throws BadCheckpoint,
  /// and std::invalid_argument for the device.
  static std::unique_ptr<Trainer> resume(const std::filesystem::path& file, const std::string& device = "cpu",
                                         std::shared_ptr<GradientExchange> exchange = nullptr);

  /// The next batch may already hold it. Adding an id twice replaces. `held_out` demos are only validated on.
  /// Throws std::invalid_argument, also for a demonstration of another robot than those before.
  virtual void add(const Demo& demo, bool held_out = false) = 0;
  virtual void remove(const std::string& id) = 0;
  /// One optimiser step. A non-finite loss or gradient skips the update and is reported; three in a row
  /// throw. A wish to stop is seen several times in every part of the batch: then the step has not taken
  /// place.
  virtual TrainStatus step(std::stop_token stop = {}) = 0;
  virtual TrainStatus status() const = 0;
  /// From now on the learning-rate schedule ends `minutes` later, or without minutes `steps` later; both 0:
  /// it stays level.
  virtual void go_on_for(double minutes, std::int64_t steps = 0) = 0;
  /// Asked to stop: the validation before.
  virtual Validation validate(int flow_steps = 4, std::stop_token stop = {}) = 0;
  /// Atomic: temporary name, sync, rename.
  virtual void save(const std::filesystem::path& file) const = 0;
  /// Throws std::runtime_error unless all processes have the same demonstrations and, bit for bit, the same
  /// weights. All of them must ask.
  virtual void require_agreement() = 0;
};

}  // namespace flowscope
