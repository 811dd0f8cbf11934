// Tasks as data: assets/tasks/<name>/scene.xml + task.yaml.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "recorder/demo_origin.h"
#include "recorder/robot.h"
#include "recorder/script.h"
#include "recorder/success_term.h"
#include "render/observation.h"

struct mjModel_;
struct mjData_;

namespace flowscope {

/// Evaluated at every physics step; ordered terms latch. Made anew by every reset.
class SuccessCheck {
 public:
  virtual ~SuccessCheck() = default;
  /// Call once per physics step, after it. `grasped` names the bodies welded to the gripper.
  virtual bool update(const mjModel_* model, const mjData_* data,
                      const std::vector<std::string>& grasped) = 0;
  /// Of the moment of the last update, which must still be there (the world's own data).
  virtual std::vector<SuccessTerm> terms() const = 0;
  /// The volumes and ways that the terms watch, of the same moment.
  virtual std::vector<Detector> detectors() const { return {}; }
  /// Shows in the scene what the terms latched (a pressed button turns green). Called after an update.
  virtual void paint(mjModel_* /*model*/) const {}
};

/// What one placement chose: everything that follows from (task, variation, seed).
struct Episode {
  std::string task;
  int variation = 0;
  std::uint64_t seed = 0;
  std::vector<std::string> instructions;  ///< all phrasings; the first is THE instruction
  Script demonstration;                   ///< the task's own script for this variation
  std::string
      demonstration_text;  ///< the same as YAML with every placeholder filled: what the page's editor shows
};

/// A task folder, read and checked. Immutable; share between threads.
class Task {
 public:
  virtual ~Task() = default;
  virtual const std::string& name() const = 0;
  virtual int variations() const = 0;
  virtual std::vector<std::string> instructions(int variation) const = 0;
  virtual Box bounds() const = 0;  ///< keyframe box, metres, world
  /// Keyframes of the longest demonstration: a policy that is not done by then starts over.
  virtual int keyframes() const = 0;
  /// Mean number of keyframes in the benchmark's demonstrations, where it is published.
  virtual std::optional<double> published_keyframes() const { return {}; }
  /// Compiled scene (robot + table + cameras + objects). The task owns it.
  virtual const mjModel_* model() const = 0;
  /// The robot in that scene; an empty description when it has none.
  virtual const RobotDescription& robot() const = 0;
  /// What its demonstrations say of where they come from.
  virtual DemoOrigin origin() const;
  /// Places and colours everything in model/data for this variation and seed and settles nothing (the world
  /// does). `model` is the world's own copy. Throws std::invalid_argument for a variation out of range.
  virtual Episode reset(mjModel_* model, mjData_* data, int variation, std::uint64_t seed) const = 0;
  /// False: an episode begins with the very state that reset() sets; nothing is given time to come to rest.
  virtual bool settles() const { return true; }
  virtual std::unique_ptr<SuccessCheck> success(const mjModel_* model, const mjData_* data,
                                                const Episode& episode) const = 0;
};

/// All task folders found. Scenes compile on first use. Any thread (get() locks).
class TaskLibrary {
 public:
  /// `assets` holds robots/, scenes/, tasks/. `extra` adds folders of tasks (--tasks DIR).
  explicit TaskLibrary(std::filesystem::path assets, std::vector<std::filesystem::path> extra = {});
  /// One more, of another kind or place; before others use the library. Throws std::invalid_argument when its
  /// name is taken.
  void add(std::shared_ptr<const Task> task);
  std::vector<std::string> names() const;
  /// Throws std::invalid_argument naming the known ones, or BadScript/std::runtime_error naming file and
  /// line.
  std::shared_ptr<const Task> get(const std::string& name) const;

 private:
  std::filesystem::path assets_;
  std::map<std::string, std::filesystem::path> folders_;
  mutable std::mutex mutex_;
  mutable std::map<std::string, std::shared_ptr<const Task>> loaded_;
};

/// Where assets/ lies: $FLOWSCOPE_ASSETS, else beside the program's source tree or installation.
std::filesystem::path find_assets();

}  // namespace flowscope
