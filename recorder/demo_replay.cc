#include "recorder/demo_replay.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flowscope {
namespace {

/// Bodies that move by themselves: neither what is fixed to the world nor the robot, which is what the
/// actuators drive.
std::vector<int> objects_of(const mjModel* model) {
  int robot = -1;
  if (model->nu > 0 && model->actuator_trntype[0] == mjTRN_JOINT) {
    robot = model->body_rootid[model->jnt_bodyid[model->actuator_trnid[0]]];
  }
  std::vector<int> objects;
  for (int body = 1; body < model->nbody; ++body) {
    if (model->body_rootid[body] != robot && model->body_weldid[body] != 0) objects.push_back(body);
  }
  return objects;
}

struct FarthestObject {
  double mm = 0;
  std::string name;
};

FarthestObject farthest_object(const World& a, const World& b, const std::vector<int>& objects) {
  FarthestObject farthest;
  for (const int body : objects) {
    const Eigen::Map<const Eigen::Vector3d> p(a.data()->xpos + 3 * body), q(b.data()->xpos + 3 * body);
    const double mm = 1000 * (p - q).norm();
    if (mm < farthest.mm) continue;
    const char* name = mj_id2name(a.model(), mjOBJ_BODY, body);
    farthest = {mm, name != nullptr ? name : "body " + std::to_string(body)};
  }
  return farthest;
}

/// Is one on in `b` that was off in `a`?
bool any_more(const std::vector<std::uint8_t>& a, const std::vector<std::uint8_t>& b) {
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    if (a[i] == 0 && b[i] != 0) return true;
  }
  return false;
}

/// The world in which it happens again beside one that shows what was recorded.
class Replay {
 public:
  Replay(const std::shared_ptr<const Task>& task, const Demo& demo)
      : world_(task), recorded_(task), objects_(objects_of(world_.model())) {
    world_.reset(demo.info.variation, demo.info.seed);
    recorded_.restore(demo.frames.front().state);
    report_.start_mm = farthest_object(world_, recorded_, objects_).mm;
  }

  World& world() { return world_; }
  World& recorded() { return recorded_; }

  void compare_with(const Frame& frame) {
    recorded_.restore(frame.state);
    const RobotState now = world_.robot();
    Divergence& d = report_.divergence;
    d.tool_mm.add(1000 * position_error_m(now.world_from_tool, frame.world_from_tool));
    d.tool_deg.add(rotation_error_rad(now.world_from_tool, frame.world_from_tool) * 180 / std::numbers::pi);
    double worst_joint = 0;
    for (std::size_t i = 0; i < frame.q.size(); ++i) {
      worst_joint = std::max(worst_joint, std::abs(now.q[i] - frame.q[i]));
    }
    d.joint_rad.add(worst_joint);
    if (!objects_.empty()) {
      const FarthestObject object = farthest_object(world_, recorded_, objects_);
      if (object.mm >= d.object_mm.max) d.object = object.name;
      d.object_mm.add(object.mm);
    }
    ++report_.moments;
  }

  ReplayReport finish(bool success, std::vector<SuccessTerm> terms, std::string failure = {}) {
    // A scene without success terms: what ran through is done, as when it was recorded.
    report_.success = success || (terms.empty() && failure.empty());
    report_.terms = std::move(terms);
    report_.failure = std::move(failure);
    return std::move(report_);
  }
  ReplayReport finish(std::string failure = {}) {
    return finish(world_.success(), world_.terms(), std::move(failure));
  }

 private:
  World world_, recorded_;
  std::vector<int> objects_;
  ReplayReport report_;
};

}  // namespace

ReplayReport replay_states(std::shared_ptr<const Task> task, const Demo& demo) {
  Replay replay(task, demo);
  World& world = replay.world();
  // A condition of its own, because restoring forgets what the world's had seen before.
  const auto check = task->success(world.model(), world.data(), world.episode());
  bool success = false;
  for (const Frame& frame : demo.frames) {
    world.restore(frame.state);
    if (check->update(world.model(), world.data(), world.grasped())) success = true;
    replay.compare_with(frame);
  }
  return replay.finish(success, check->terms());
}

ReplayReport replay_targets(std::shared_ptr<const Task> task, const Demo& demo) {
  Replay replay(task, demo);
  World &world = replay.world(), &recorded = replay.recorded();
  world.restore(demo.frames.front().state);
  try {
    for (std::size_t i = 1; i < demo.frames.size(); ++i) {
      const SceneState &before = demo.frames[i - 1].state, &after = demo.frames[i].state;
      // Bodies are taken and let go between two frames.
      if (any_more(after.eq_active, before.eq_active)) world.release();
      if (any_more(before.eq_active, after.eq_active)) world.grasp();
      recorded.restore(after);
      world.advance(recorded.joint_targets(), recorded.openness_target());
      replay.compare_with(demo.frames[i]);
    }
  } catch (const SimulationFailed& error) {
    return replay.finish(error.what());
  }
  return replay.finish();
}

ReplayReport replay_actions(std::shared_ptr<const Task> task, const Demo& demo, const CarryOut& carry_out) {
  Replay replay(task, demo);
  World& world = replay.world();
  world.restore(demo.frames.front().state);
  const FrameSink until_success = [&](const Frame&) { return !world.success(); };
  for (std::size_t k = 0; k < demo.keyframes.size() && !world.success(); ++k) {
    const Keyframe& keyframe = demo.keyframes[k];
    const MotionResult result = carry_out(world, keyframe.action, until_success);
    replay.compare_with(demo.frames.at(static_cast<std::size_t>(keyframe.frame)));
    const bool stopped_by_things = result.failure == MotionFailure::not_reached;  // as in eval: go on
    if (!result && !stopped_by_things && !world.success()) {
      return replay.finish("keyframe " + std::to_string(k) + ": " + to_string(result.failure) + ": " +
                           result.message);
    }
  }
  return replay.finish();
}

}  // namespace flowscope
