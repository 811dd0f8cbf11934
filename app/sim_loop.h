// The thread that owns the world.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "app/job_queue.h"
#include "app/latest.h"
#include "policy/policy.h"
#include "recorder/record.h"
#include "recorder/world.h"

namespace flowscope {

/// What everybody else may know of the world, at one moment.
struct SimSnapshot {
  SceneState state;
  std::string task, instruction;
  std::string script_text;  ///< the task's own demonstration for this episode, YAML
  std::vector<std::string> instructions;
  int variation = 0;
  std::uint64_t seed = 0, episode = 0;  ///< episode counts resets
  std::vector<SuccessTerm> terms;
  std::vector<Detector> detectors;
  bool success = false;
  std::vector<RobotState>
      keyframe_history;  ///< the robot at the start and at every keyframe since; a policy's history
};

/// Runs jobs on the world and publishes a snapshot after every frame. Public methods: any thread.
class SimLoop {
 public:
  using SnapshotPtr = Latest<SimSnapshot>::Ptr;

  explicit SimLoop(const TaskLibrary& tasks);
  ~SimLoop();

  const Latest<SimSnapshot>& snapshot() const { return snapshot_; }
  /// Called on the sim thread after every publish.
  void on_publish(std::function<void()> listener) { listener_ = std::move(listener); }

  /// Throws what the task library throws, through the future.
  std::future<void> reset(std::string task, int variation, std::uint64_t seed);
  /// `observe` takes the pictures of the keyframes; it is called on the sim thread.
  std::future<RunReport> run_script(Script script, Observe observe, std::stop_token stop);
  /// Moves to a predicted keyframe as the benchmark's evaluation does: arm first, then the gripper.
  std::future<MotionResult> execute(GripperAction action, std::uint64_t seed, std::stop_token stop);

  /// Simulated seconds per wall second while somebody watches; nobody watches: as fast as it goes.
  void pace(double factor) { pace_ = factor; }

 private:
  struct Room {
    std::unique_ptr<World> world;
    std::uint64_t episode = 0;
    std::vector<RobotState> history;
    std::vector<Frame>
        run;  ///< frames since the last reset or execute, without states: where its keyframes were
  };
  void publish(Room& room);
  void see(Room& room, const Frame& frame);
  World& world(Room& room);

  const TaskLibrary& tasks_;
  std::function<void()> listener_;
  std::atomic<double> pace_{0};
  Latest<SimSnapshot> snapshot_;
  JobQueue<Room> queue_;
  std::jthread thread_;
};

/// One predicted keyframe: a straight line if that is free, else planned, else without collision checks; then
/// the gripper, and half a second for what it let go of.
MotionResult execute_keyframe(World& world, const GripperAction& action, std::uint64_t seed,
                              const FrameSink& sink, std::stop_token stop = {});

}  // namespace flowscope
