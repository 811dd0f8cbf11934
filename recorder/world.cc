#include "recorder/world.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "recorder/floor.h"
#include "recorder/frame_time.h"
#include "recorder/task_placement.h"
#include "recorder/world_robot.h"
#include "render/mujoco_guard.h"
#include "render/mujoco_owners.h"

namespace flowscope {
namespace {

constexpr int kSettleFrames = 10;

/// Sum of the engine's counters that tell that this run means nothing any more.
int trouble(const mjData* data) {
  int count = 0;
  for (const int kind : {mjWARN_INERTIA, mjWARN_CONTACTFULL, mjWARN_CNSTRFULL, mjWARN_BADQPOS, mjWARN_BADQVEL,
                         mjWARN_BADQACC, mjWARN_BADCTRL}) {
    count += data->warning[kind].number;
  }
  return count;
}

std::vector<double> copied(const mjtNum* values, int count) { return {values, values + count}; }

/// Throws std::invalid_argument for a state of another scene or size.
void check_fits(const mjModel* m, const std::string& scene, const SceneState& state) {
  if (state.scene != scene) {
    throw std::invalid_argument("a state of scene '" + state.scene + "' does not fit the scene of " + scene);
  }
  const auto check_size = [&](std::size_t have, int want, const char* what) {
    if (have != static_cast<std::size_t>(want)) {
      throw std::invalid_argument("a state with " + std::to_string(have) + " values of " + what +
                                  " does not fit " + scene + ", which has " + std::to_string(want));
    }
  };
  check_size(state.qpos.size(), m->nq, "qpos");
  check_size(state.qvel.size(), m->nv, "qvel");
  check_size(state.act.size(), m->na, "act");
  check_size(state.ctrl.size(), m->nu, "ctrl");
  check_size(state.qacc_warmstart.size(), m->nv, "qacc_warmstart");
  check_size(state.mocap_pos.size(), 3 * m->nmocap, "mocap_pos");
  check_size(state.mocap_quat.size(), 4 * m->nmocap, "mocap_quat");
  check_size(state.eq_active.size(), m->neq, "eq_active");
  check_size(state.eq_data.size(), mjNEQDATA * m->neq, "eq_data");
  check_size(state.mat_rgba.size(), 4 * m->nmat, "mat_rgba");
}

}  // namespace

struct World::Impl {
  explicit Impl(std::shared_ptr<const Task> its_task)
      : task(std::move(its_task)), robot(task->model(), task->robot()) {
    rebuild();
  }

  void rebuild() {
    model.reset(mj_copyModel(nullptr, task->model()));
    data.reset(mj_makeData(model.get()));
    if (!model || !data) throw std::runtime_error("no memory for the scene of " + task->name());
    floor = Floor(model.get());
    steps_per_frame = static_cast<int>(std::lround(frame_s / model->opt.timestep));
  }

  /// Everything that follows from positions, up to date with them (a physics step leaves it one step behind).
  void refresh() const {
    mj_kinematics(model.get(), data.get());
    mj_comPos(model.get(), data.get());
    mj_camlight(model.get(), data.get());
  }

  void judge() {
    if (check->update(model.get(), data.get(), robot.grasped(model.get()))) success = true;
    check->paint(model.get());
  }

  void step(const std::array<double, 7>& target, const std::array<double, 7>& speed, double openness) {
    const double expected = data->time + model->opt.timestep;
    mj_step1(model.get(), data.get());
    robot.drive(data.get(), target, speed, openness, !robot.grasped(model.get()).empty());
    mj_step2(model.get(), data.get());
    // After a NaN the engine resets its data in silence and goes on: the clock tells.
    if (trouble(data.get()) > 0 || std::abs(data->time - expected) > 1e-9) {
      const std::string why = take_mujoco_warning();
      throw std::runtime_error(why.empty() ? "the engine reset itself" : why);
    }
    refresh();
  }

  void frame(const std::array<double, 7>& target, double openness, bool judged) {
    floor.watch(model.get(), data.get());
    const auto from = robot.joint_targets(data.get());
    std::array<double, 7> now{}, speed{};
    for (int k = 1; k <= steps_per_frame; ++k) {
      const double part = static_cast<double>(k) / steps_per_frame;
      for (std::size_t i = 0; i < 7; ++i) {
        now[i] = k == steps_per_frame ? target[i] : from[i] + part * (target[i] - from[i]);
        speed[i] = (target[i] - from[i]) / frame_s;
      }
      step(now, speed, openness);
      if (judged) judge();
    }
  }

  /// Runs `action`; an engine error leaves a fresh world behind and becomes SimulationFailed.
  template <typename Action>
  void guarded(const Action& action) {
    try {
      action();
    } catch (const std::runtime_error& error) {
      const double when = data ? data->time : 0;
      rebuild();
      start(episode.variation, episode.seed);
      throw SimulationFailed("the simulation of " + task->name() + " failed at " + std::to_string(when) +
                             " s: " + error.what());
    }
  }

  void start(int variation, std::uint64_t seed) {
    mj_resetData(model.get(), data.get());
    robot.go_home(data.get());
    episode = task->reset(model.get(), data.get(), variation, seed);
    success = false;
    mj_forward(model.get(), data.get());
    for (int i = 0; i < kSettleFrames && task->settles(); ++i) frame(task->robot().home, 1, false);
    data->time = 0;
    start_qpos = copied(data->qpos, model->nq);
    check = task->success(model.get(), data.get(), episode);
    judge();
  }

  std::shared_ptr<const Task> task;
  WorldRobot robot;
  ModelPtr model;
  DataPtr data;
  Floor floor;
  int steps_per_frame = 0;
  Episode episode;
  std::unique_ptr<SuccessCheck> check;
  std::vector<double> start_qpos;  ///< after settling: what the success terms measure from
  bool success = false;
};

World::World(std::shared_ptr<const Task> task) {
  install_mujoco_guard();
  impl_ = std::make_unique<Impl>(std::move(task));
  reset(0, 0);
}
World::~World() = default;

void World::reset(int variation, std::uint64_t seed) {
  if (variation < 0 || variation >= task().variations()) {
    throw std::invalid_argument("task " + task().name() + " has variations 0 to " +
                                std::to_string(task().variations() - 1) + ", not " +
                                std::to_string(variation));
  }
  impl_->start(variation, seed);
}

const Task& World::task() const { return *impl_->task; }
const Episode& World::episode() const { return impl_->episode; }

Frame World::advance(const std::array<double, 7>& joint_target, double openness_target) {
  for (const double q : joint_target) {
    if (!std::isfinite(q)) throw std::invalid_argument("a joint target is not a finite number");
  }
  if (!(openness_target >= 0 && openness_target <= 1)) {
    throw std::invalid_argument("the finger openness must lie in 0 to 1");
  }
  impl_->guarded([&] { impl_->frame(joint_target, openness_target, true); });
  return frame();
}

void World::grasp() { impl_->robot.grasp(impl_->model.get(), impl_->data.get()); }
void World::release() { impl_->robot.release(impl_->model.get()); }
std::vector<std::string> World::grasped() const { return impl_->robot.grasped(impl_->model.get()); }

bool World::success() const { return impl_->success; }
std::vector<SuccessTerm> World::terms() const { return impl_->check->terms(); }
std::vector<Detector> World::detectors() const { return impl_->check->detectors(); }

Frame World::frame() const {
  const mjData* data = impl_->data.get();
  const WorldRobot& robot = impl_->robot;
  Frame frame;
  frame.time_s = data->time;
  frame.q = robot.positions(data);
  frame.dq = robot.speeds(data);
  frame.openness = robot.openness(data);
  frame.gripper_open = frame.openness > fully_open;
  frame.world_from_tool = robot.world_from_tool(data);
  frame.state = state();
  return frame;
}

SceneState World::state() const {
  const mjModel* m = impl_->model.get();
  const mjData* d = impl_->data.get();
  SceneState state;
  state.scene = task().name();
  state.time_s = d->time;
  state.qpos = copied(d->qpos, m->nq);
  state.qvel = copied(d->qvel, m->nv);
  state.act = copied(d->act, m->na);
  state.ctrl = copied(d->ctrl, m->nu);
  state.qacc_warmstart = copied(d->qacc_warmstart, m->nv);
  state.mocap_pos = copied(d->mocap_pos, 3 * m->nmocap);
  state.mocap_quat = copied(d->mocap_quat, 4 * m->nmocap);
  state.eq_active.assign(m->eq_active, m->eq_active + m->neq);
  state.eq_data = copied(m->eq_data, mjNEQDATA * m->neq);
  state.mat_rgba.assign(m->mat_rgba, m->mat_rgba + 4 * m->nmat);
  return state;
}

void World::restore(const SceneState& state) {
  const mjModel* m = impl_->model.get();
  check_fits(m, task().name(), state);
  mjData* d = impl_->data.get();
  mj_resetData(m, d);
  std::copy(impl_->start_qpos.begin(), impl_->start_qpos.end(), d->qpos);
  impl_->check = task().success(m, d, impl_->episode);
  impl_->success = false;
  follow(state);
}

void World::follow(const SceneState& state) {
  mjModel* m = impl_->model.get();
  mjData* d = impl_->data.get();
  check_fits(m, task().name(), state);
  std::copy(state.eq_active.begin(), state.eq_active.end(), m->eq_active);
  std::copy(state.eq_data.begin(), state.eq_data.end(), m->eq_data);
  std::copy(state.mat_rgba.begin(), state.mat_rgba.end(), m->mat_rgba);
  std::copy(state.qpos.begin(), state.qpos.end(), d->qpos);
  std::copy(state.qvel.begin(), state.qvel.end(), d->qvel);
  std::copy(state.act.begin(), state.act.end(), d->act);
  std::copy(state.ctrl.begin(), state.ctrl.end(), d->ctrl);
  std::copy(state.qacc_warmstart.begin(), state.qacc_warmstart.end(), d->qacc_warmstart);
  std::copy(state.mocap_pos.begin(), state.mocap_pos.end(), d->mocap_pos);
  std::copy(state.mocap_quat.begin(), state.mocap_quat.end(), d->mocap_quat);
  d->time = state.time_s;
  impl_->refresh();
  impl_->judge();
}

std::array<double, 7> World::joint_targets() const { return impl_->robot.joint_targets(impl_->data.get()); }
double World::openness_target() const { return impl_->robot.openness_target(impl_->data.get()); }

RobotState World::robot() const {
  const mjData* data = impl_->data.get();
  return {impl_->robot.world_from_tool(data), impl_->robot.openness(data), impl_->robot.positions(data)};
}

Pose World::world_from(const std::string& frame) const {
  const mjModel* m = impl_->model.get();
  if (const auto pose = find_frame(m, impl_->data.get(), frame)) return *pose;
  throw std::invalid_argument(unknown_frame_text(m, frame));
}

const mjModel* World::model() const { return impl_->model.get(); }
const mjData* World::data() const { return impl_->data.get(); }

}  // namespace flowscope
