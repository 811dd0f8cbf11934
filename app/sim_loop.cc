#include "app/sim_loop.h"

#include <chrono>

#include "recorder/keyframes.h"

namespace flowscope {
namespace {

constexpr int falling_frames = 10;  // what the hand let go of may still have to fall, as at a script's end

MotionResult let_fall(World& world, double openness, const FrameSink& sink, const std::stop_token& stop) {
  const auto q = world.robot().q;
  try {
    for (int i = 0; i < falling_frames && !world.success() && !stop.stop_requested(); ++i) {
      if (!sink(world.advance(q, openness))) break;
    }
  } catch (const SimulationFailed& error) {
    return {MotionFailure::simulation, error.what()};
  }
  return {};
}

}  // namespace

MotionResult execute_keyframe(World& world, const GripperAction& action, std::uint64_t seed,
                              const FrameSink& sink, std::stop_token stop) {
  MoveRequest request;
  request.world_from_tool = action.world_from_tool;
  request.seed = seed;
  MotionResult result;
  // The benchmark's order of attempts: a free line, RRTConnect, then the same without collision checks. But a
  // line through what gives way is a push: around that there is always some path, which would push nothing.
  for (const auto& [linear, ignore] : {std::pair{true, false}, {false, false}, {true, true}, {false, true}}) {
    request.may_push = linear && !ignore;
    request.linear = linear;
    request.ignore_collisions = ignore;
    result = move_to(world, request, sink, stop);
    if (result || result.failure == MotionFailure::cancelled || result.failure == MotionFailure::simulation)
      break;
    // Pressed against something where it was to go is as good as there; stopped on the way is tried
    // otherwise.
    const bool near = position_error_m(world.robot().world_from_tool, action.world_from_tool) < 0.02;
    if (result.failure == MotionFailure::not_reached && (near || world.success())) break;
  }
  const bool arrived = result || result.failure == MotionFailure::not_reached;
  if (arrived && !world.success()) {
    const bool lets_go = action.open() && world.robot().openness < 0.9;
    MotionResult hand = move_gripper(world, action.openness, sink, stop);
    if (hand && lets_go) hand = let_fall(world, action.openness, sink, stop);
    if (!hand) return hand;
  }
  return result;
}

SimLoop::SimLoop(const TaskLibrary& tasks) : tasks_(tasks) {
  thread_ = std::jthread([this] {
    Room room;
    std::chrono::milliseconds sleep(1000);
    while (queue_.run_next(room, sleep)) sleep = jog_on(room);
  });
}

SimLoop::~SimLoop() {
  queue_.close();
  snapshot_.close();
}

World& SimLoop::world(Room& room) {
  if (!room.world) throw std::logic_error("no task is open: reset first");
  return *room.world;
}

void SimLoop::publish(Room& room) {
  SimSnapshot snapshot;
  const World& w = world(room);
  snapshot.state = w.state();
  snapshot.task = w.task().name();
  snapshot.instructions = w.episode().instructions;
  snapshot.instruction = snapshot.instructions.empty() ? "" : snapshot.instructions.front();
  snapshot.script_text = w.episode().demonstration_text;
  snapshot.variation = w.episode().variation;
  snapshot.seed = w.episode().seed;
  snapshot.episode = room.episode;
  snapshot.terms = w.terms();
  snapshot.detectors = w.detectors();
  snapshot.success = w.success();
  snapshot.keyframe_history = room.history;
  snapshot.robot = w.robot();
  snapshot.by_hand = {room.session.frames(), room.session.strokes(), room.session.marks(),
                      room.session.moved_by_hand()};
  snapshot_.publish(std::move(snapshot));
  if (listener_) listener_();
}

void SimLoop::see(Room& room, const Frame& frame) {
  using Clock = std::chrono::steady_clock;
  room.session.keep(frame);
  publish(room);
  room.run.push_back(frame);
  room.run.back().state = {};
  if (const double pace = pace_; pace > 0) {
    thread_local Clock::time_point due{};
    const auto now = Clock::now();
    due = std::max(
        due + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(0.05 / pace)),
        now - std::chrono::milliseconds(20));
    if (due > now) std::this_thread::sleep_until(due);
  }
}

void SimLoop::set_up(Room& room, const std::string& task, int variation, std::uint64_t seed) {
  auto wanted = tasks_.get(task);
  if (!room.world || &room.world->task() != wanted.get()) {
    auto fresh = std::make_unique<World>(wanted);
    fresh->reset(variation, seed);  // only a world that could be reset replaces the old one
    room.world = std::move(fresh);
  } else {
    room.world->reset(variation, seed);
  }
  ++room.episode;
  end_jog(room);
  room.session.restart(*room.world);
  room.history = {room.world->robot()};
  room.run.clear();
  publish(room);
}

std::future<void> SimLoop::reset(std::string task, int variation, std::uint64_t seed) {
  return queue_.post(
      [this, task = std::move(task), variation, seed](Room& room) { set_up(room, task, variation, seed); });
}

void SimLoop::require_scene(const Room& room, const Placement& wanted) const {
  if (room.world) {
    const Episode& now = room.world->episode();
    if (Placement{now.task, now.variation, now.seed} == wanted) return;
  }
  throw SceneChanged("the scene was set up anew before the script could begin");
}

void SimLoop::restart_if_rebuilt(Room& room) {
  const World& w = world(room);
  if (room.session.holds(w.frame().time_s)) return;
  ++room.episode;
  room.session.restart(w);
  room.history = {w.robot()};
  room.run.clear();
}

RunReport SimLoop::run(Room& room, const Script& script, const Observe& observe,
                       const std::stop_token& stop) {
  end_jog(room);
  room.run.clear();
  RunReport report = flowscope::run_script(
      world(room), script, observe, [&](const Frame& frame) { see(room, frame); }, stop);
  for (int k : keyframes_to_learn(room.run)) {
    const Frame& frame = room.run[k];
    room.history.push_back({frame.world_from_tool, frame.openness, frame.q});
  }
  restart_if_rebuilt(room);
  publish(room);
  return report;
}

std::future<RunReport> SimLoop::run_script(Placement wanted, Script script, std::stop_token stop) {
  return queue_.post([this, wanted = std::move(wanted), script = std::move(script), stop](Room& room) {
    require_scene(room, wanted);
    return run(room, script, {}, stop);
  });
}

std::future<RunReport> SimLoop::record_script(Placement wanted, Script script, Observe observe,
                                              std::stop_token stop) {
  return queue_.post([this, wanted = std::move(wanted), script = std::move(script),
                      observe = std::move(observe), stop](Room& room) {
    require_scene(room, wanted);
    if (stop.stop_requested()) {  // the scene is another's by now
      RunReport report;
      report.reason = "cancelled before it began";
      return report;
    }
    set_up(room, wanted.task, wanted.variation, wanted.seed);
    return run(room, script, observe, stop);
  });
}

std::future<MotionResult> SimLoop::execute(GripperAction action, std::uint64_t seed, std::uint64_t episode,
                                           std::stop_token stop) {
  return queue_.post([this, action, seed, episode, stop](Room& room) {
    World& w = world(room);
    if (room.episode != episode) throw SceneChanged("the scene was set up anew before the arm could move");
    end_jog(room);
    MotionResult result = execute_keyframe(
        w, action, seed,
        [&](const Frame& frame) {
          see(room, frame);
          return !w.success() && !stop.stop_requested();
        },
        stop);
    room.history.push_back(w.robot());
    restart_if_rebuilt(room);
    publish(room);
    return result;
  });
}

}  // namespace flowscope
