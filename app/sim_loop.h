// The thread that owns the world.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "app/job_queue.h"
#include "app/jog_control.h"
#include "app/latest.h"
#include "policy/policy.h"
#include "recorder/record.h"
#include "recorder/teleop_session.h"
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
  RobotState robot;
  struct ByHand {
    int frames = 0, strokes = 0, marks = 0;
    bool moved = false;
  };
  ByHand by_hand;  ///< the session since the reset
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
  /// A placement of a task. Another episode with the same one is as good.
  struct Placement {
    std::string task;
    int variation = 0;
    std::uint64_t seed = 0;
    bool operator==(const Placement&) const = default;
  };
  /// The scene is another one than the script was given for.
  class SceneChanged : public std::runtime_error {
   public:
    using std::runtime_error::runtime_error;
  };
  /// Runs it in the scene as it is, which must still be of placement `wanted`: SceneChanged.
  std::future<RunReport> run_script(Placement wanted, Script script, std::stop_token stop);
  /// Resets to the placement and runs, as one: nothing comes between, and the demonstration begins where the
  /// benchmark's does. `observe` takes the pictures of the keyframes; it is called on the sim thread.
  std::future<RunReport> record_script(Placement wanted, Script script, Observe observe,
                                       std::stop_token stop);
  /// Moves to a predicted keyframe as the benchmark's evaluation does: arm first, then the gripper. Throws
  /// SceneChanged when `episode` (of the snapshot that it was predicted for) is over.
  std::future<MotionResult> execute(GripperAction action, std::uint64_t seed, std::uint64_t episode,
                                    std::stop_token stop);

  /// Moves the tool by hand, in real time, until the command is renewed no more.
  void jog(const JogCommand& command);
  JogControl::Report jog_report() const { return jog_.report(); }
  std::future<MotionResult> jog_gripper(double openness);
  /// Back to before the last movement by hand; false when there is none.
  std::future<bool> undo_jog();
  /// Marks the present moment as a keyframe; the tool's pose and the fingers as steps of a script.
  std::future<std::vector<Step>> mark();
  /// A demonstration of everything since the reset. Throws std::logic_error as TeleopSession does.
  std::future<Demo> session_demo(Observe observe);

  /// Simulated seconds per wall second while somebody watches; nobody watches: as fast as it goes.
  void pace(double factor) { pace_ = factor; }

 private:
  struct Room {
    std::unique_ptr<World> world;
    std::uint64_t episode = 0;
    std::vector<RobotState> history;
    std::vector<Frame>
        run;  ///< frames since the last reset or execute, without states: where its keyframes were
    TeleopSession session;
    std::optional<Jogger> jogger;  ///< of the movement by hand in progress
    JogControl::Clock::time_point next_jog{};
  };
  void set_up(Room& room, const std::string& task, int variation, std::uint64_t seed);
  /// Throws SceneChanged.
  void require_scene(const Room& room, const Placement& wanted) const;
  RunReport run(Room& room, const Script& script, const Observe& observe, const std::stop_token& stop);
  /// After a motion: a simulation that failed has set the scene up anew, and what moved before is no part of
  /// it.
  void restart_if_rebuilt(Room& room);
  void publish(Room& room);
  void see(Room& room, const Frame& frame);
  /// Where the hand goes on when other motions have to end first, or when the world is another now.
  void end_jog(Room& room);
  /// The next frame of a movement by hand, when it is due; how long the thread may sleep then.
  std::chrono::milliseconds jog_on(Room& room);
  World& world(Room& room);

  const TaskLibrary& tasks_;
  std::function<void()> listener_;
  std::atomic<double> pace_{0};
  Latest<SimSnapshot> snapshot_;
  JogControl jog_;
  JobQueue<Room> queue_;
  std::jthread thread_;
};

/// One predicted keyframe: a straight line if that is free, else planned, else without collision checks; then
/// the gripper, and half a second for what it let go of.
MotionResult execute_keyframe(World& world, const GripperAction& action, std::uint64_t seed,
                              const FrameSink& sink, std::stop_token stop = {});

}  // namespace flowscope
