// The simulated table: one robot, one task, one episode at a time.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "recorder/demo.h"
#include "recorder/task.h"

struct mjModel_;
struct mjData_;

namespace flowscope {

/// From this openness on a gripper counts as open (Frame::gripper_open).
inline constexpr double fully_open = 0.95;

/// A simulation that blew up (NaN, contact buffer full, engine error). The world has been rebuilt; the run is
/// invalid.
class SimulationFailed : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Owns mjData and its own copy of the model. One thread at a time. Deterministic: same task, variation, seed
/// and calls give the same states, bit for bit.
class World {
 public:
  explicit World(std::shared_ptr<const Task> task);
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  /// Home pose, new placement, and half a second to settle where the task lets it.
  void reset(int variation, std::uint64_t seed);
  const Task& task() const;
  const Episode& episode() const;

  /// Advances one recorded frame (0.05 s of physics) towards joint targets (rad) and finger openness; success
  /// terms are evaluated at every physics step. Returns the frame at its end.
  Frame advance(const std::array<double, 7>& joint_target, double openness_target);
  /// Welds what lies between the fingers (closing) or lets go (opening). Called by the motion code at the end
  /// of a gripper move.
  void grasp();
  void release();
  std::vector<std::string> grasped() const;

  bool success() const;  ///< true once the task's condition has held (latched)
  std::vector<SuccessTerm> terms() const;
  std::vector<Detector> detectors() const;  ///< what the terms watch, in the world frame

  Frame frame() const;  ///< the present moment
  SceneState state() const;
  void restore(const SceneState& state);  ///< throws std::invalid_argument when sizes differ
  /// The same as the next moment of this episode: what the success terms have latched stays.
  void follow(const SceneState& state);
  RobotState robot() const;
  /// What joints (rad) and fingers were last told: what does not move goes on holding with that.
  std::array<double, 7> joint_targets() const;
  double openness_target() const;
  Pose world_from(const std::string& frame)
      const;  ///< world, tool, body or site; throws std::invalid_argument with the known names
  const mjModel_* model() const;
  const mjData_* data() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace flowscope
