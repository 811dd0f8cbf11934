#include "recorder/record.h"

#include <mujoco/mujoco.h>

#include <chrono>
#include <cmath>
#include <cstdio>

#include "recorder/demo_check.h"
#include "recorder/keyframes.h"
#include "recorder/lost_things.h"
#include "recorder/script_check.h"
#include "recorder/script_poses.h"
#include "recorder/utc_time.h"

namespace flowscope {
namespace {

constexpr int kPatience_frames = 10;  ///< after the last step: a released object may still have to fall

std::string false_terms(const World& world) {
  std::string text;
  for (const auto& term : world.terms()) {
    if (term.met) continue;
    text += text.empty() ? "" : "; ";
    text += "success term " + term.name + " is false" + (term.value.empty() ? "" : " (" + term.value + ")");
  }
  return text.empty() ? "the task's condition does not hold" : text;
}

std::string waypoint_text(const RunReport& report) {
  return "waypoint " + std::to_string(report.step + 1) + " (line " + std::to_string(report.line) + "): ";
}

/// Nothing has moved yet, and what is wrong is the pose.
bool another_yaw_may_help(MotionFailure failure) {
  return failure == MotionFailure::unreachable || failure == MotionFailure::in_collision ||
         failure == MotionFailure::timed_out;
}

/// One run in progress.
class ScriptRun {
 public:
  ScriptRun(World& world, const Script& script, const std::function<void(const Frame&)>& on_frame,
            std::stop_token stop)
      : world_(world), script_(script), on_frame_(on_frame), stop_(std::move(stop)) {
    keep(world.frame());
  }

  /// Fills step, line and reason where it fails.
  bool execute(RunReport& report) {
    if (const auto problem = find_problem(script_, world_.task())) {
      report.step = problem->step;
      report.line = problem->place.line;
      report.reason = problem->step < 0 ? problem->message : waypoint_text(report) + problem->message;
      return false;
    }
    for (std::size_t i = 0; i < script_.steps.size() && !world_.success(); ++i) {
      const MotionResult result = execute(script_.steps[i], i);
      if (result || world_.success()) continue;
      report.step = static_cast<int>(i);
      report.line = script_.steps[i].line;
      report.world_from_tool = result.world_from_tool;
      report.reason = waypoint_text(report) + to_string(result.failure) + ": " + result.message;
      return false;
    }
    return await_success(report);
  }

  const SceneState& start() const { return frames_.front().state; }
  std::vector<Frame> take_frames() { return std::move(frames_); }
  std::vector<TermSeries> take_terms() { return std::move(terms_); }
  double sim_seconds() const { return frames_.back().time_s - frames_.front().time_s; }

 private:
  /// The step in which the task succeeds is finished: its end is where the expert meant to go, not where the
  /// condition happened to become true.
  bool keep(const Frame& frame) {
    frames_.push_back(frame);
    append_terms(world_.terms(), terms_);
    if (on_frame_) on_frame_(frame);
    return true;
  }

  /// The straight moves that follow step `index`, which ends with the tool at `tool`.
  std::vector<Pose> lines_after(std::size_t index, Pose tool) const {
    std::vector<Pose> lines;
    for (std::size_t i = index + 1; i < script_.steps.size(); ++i) {
      const auto* move = std::get_if<MoveStep>(&script_.steps[i].what);
      if (!move) continue;
      if (!move->linear) break;
      tool = place_move(world_, *move, tool).world_from_tool;
      lines.push_back(tool);
    }
    return lines;
  }

  /// With the yaws that are as good, the least turn first, as long as the lines that follow are possible; in
  /// the end the least turn in any case. Straight lines turn as little as they can.
  std::vector<MoveRequest> attempts_at(const MoveStep& move, std::size_t index) const {
    MoveRequest request;
    request.linear = move.linear;
    request.ignore_collisions = move.ignore_collisions;
    request.seed = world_.episode().seed * 10'007 + index;
    std::vector<MoveRequest> attempts;
    for (const PlacedMove& placed : place_choices(world_, move, world_.robot().world_from_tool)) {
      request.world_from_tool = placed.world_from_tool;
      request.then = lines_after(index, request.world_from_tool);
      if (move.linear) return {request};
      request.must_lead_on = true;
      attempts.push_back(request);
    }
    attempts.push_back(attempts.front());
    attempts.back().must_lead_on = false;
    return attempts;
  }

  MotionResult execute(const Step& step, std::size_t index) {
    const FrameSink sink = [this](const Frame& frame) { return keep(frame); };
    if (const auto* gripper = std::get_if<GripperStep>(&step.what)) {
      return move_gripper(world_, gripper->openness, sink, stop_);
    }
    std::vector<MoveRequest> attempts;
    try {
      attempts = attempts_at(std::get<MoveStep>(step.what), index);
    } catch (const std::invalid_argument& error) {
      return {MotionFailure::unreachable, error.what()};
    }
    MotionResult result;
    for (const MoveRequest& attempt : attempts) {
      result = move_to(world_, attempt, sink, stop_);
      if (!another_yaw_may_help(result.failure)) break;
    }
    return result;
  }

  bool await_success(RunReport& report) {
    if (world_.terms().empty()) return true;  // a scene without success terms: what ran through is done
    try {
      const auto q = frames_.back().q;
      const double openness = frames_.back().openness;
      for (int i = 0; i < kPatience_frames && !world_.success(); ++i) keep(world_.advance(q, openness));
    } catch (const SimulationFailed& error) {
      report.reason = error.what();
      return false;
    }
    if (world_.success()) return true;
    report.step = static_cast<int>(script_.steps.size()) - 1;
    report.line = script_.steps.back().line;
    report.reason = false_terms(world_);
    return false;
  }

  World& world_;
  const Script& script_;
  const std::function<void(const Frame&)>& on_frame_;
  std::stop_token stop_;
  std::vector<Frame> frames_;
  std::vector<TermSeries> terms_;
};

/// Who closes the hand high above the table has a keyframe there, far outside the task's own box.
void widen(Box& box, const std::vector<Keyframe>& keyframes) {
  const Eigen::Vector3d least = box.min.array() - most_outside_m, most = box.max.array() + most_outside_m;
  for (const Keyframe& keyframe : keyframes) {
    const Eigen::Vector3d& p = keyframe.action.world_from_tool.position;
    if (Box{least, most}.contains(p)) continue;
    box.min = box.min.cwiseMin(p);
    box.max = box.max.cwiseMax(p);
  }
}

}  // namespace

Demo make_demo(const World& world, std::vector<Frame> frames, const std::vector<int>& keyframes,
               const Observe& observe) {
  const Episode& episode = world.episode();
  Demo demo;
  demo.info.task = episode.task;
  demo.info.variation = episode.variation;
  demo.info.seed = episode.seed;
  demo.instructions = episode.instructions;
  if (!demo.instructions.empty()) demo.info.instruction = demo.instructions.front();
  demo.info.created = utc_now();
  demo.info.origin = world.task().origin();
  if (!world.terms().empty()) demo.info.success = world.success();
  demo.simulator = std::string("MuJoCo ") + mj_versionString();
  demo.bounds = world.task().bounds();
  demo.start = observe(frames.front().state);
  for (const int index : keyframes) {
    const Frame& frame = frames[index];
    // The openness of an action is the benchmark's bit: while the fingers still travel, where they are going.
    demo.keyframes.push_back(
        {index, {frame.world_from_tool, frame.gripper_open ? 1.0 : 0.0}, observe(frame.state)});
  }
  widen(demo.bounds, demo.keyframes);
  demo.info.frames = static_cast<int>(frames.size());
  demo.info.keyframes = static_cast<int>(demo.keyframes.size());
  demo.frames = std::move(frames);
  return demo;
}

std::vector<std::string> observation_cameras(const mjModel* model) {
  std::vector<std::string> found, own;
  for (const char* name : {"front", "left_shoulder", "right_shoulder", "wrist"}) {
    if (mj_name2id(model, mjOBJ_CAMERA, name) >= 0) found.emplace_back(name);
  }
  for (int i = 0; i < model->ncam; ++i) {
    if (const char* name = mj_id2name(model, mjOBJ_CAMERA, i)) own.emplace_back(name);
  }
  return found.empty() ? own : found;
}

RunReport run_script(World& world, const Script& script, const Observe& observe,
                     const std::function<void(const Frame&)>& on_frame, std::stop_token stop) {
  const auto begin = std::chrono::steady_clock::now();
  RunReport report;
  ScriptRun run(world, script, on_frame, std::move(stop));
  report.success = run.execute(report);
  if (!report.success) report.reason += lost_text(world, run.start());
  report.sim_seconds = run.sim_seconds();
  report.terms = run.take_terms();
  if (report.success && observe) {
    std::vector<Frame> frames = run.take_frames();
    const std::vector<int> keyframes = keyframes_to_learn(frames);
    report.demo = make_demo(world, std::move(frames), keyframes, observe);
  }
  report.wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return report;
}

}  // namespace flowscope
