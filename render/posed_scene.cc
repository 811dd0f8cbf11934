#include "render/posed_scene.h"

#include <algorithm>
#include <numbers>
#include <stdexcept>

#include "render/mujoco_guard.h"

namespace flowscope {

namespace {

template <typename T>
void check_size(const char* what, const std::vector<T>& values, int expected) {
  if (values.size() != static_cast<std::size_t>(expected)) {
    throw std::invalid_argument("scene state: " + std::string(what) + " has " +
                                std::to_string(values.size()) + " numbers, the model has " +
                                std::to_string(expected));
  }
}

void check_finite(const char* what, const std::vector<double>& values) {
  if (!std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); })) {
    throw std::invalid_argument("scene state: " + std::string(what) + " is not finite");
  }
}

}  // namespace

PosedScene::PosedScene(const mjModel* model, std::string scene) : scene_(std::move(scene)) {
  install_mujoco_guard();
  if (model == nullptr) throw std::invalid_argument("renderer: no model");
  model_.reset(mj_copyModel(nullptr, model));
  data_.reset(model_ ? mj_makeData(model_.get()) : nullptr);
  if (!data_) throw std::runtime_error("renderer: not enough memory for scene '" + scene_ + "'");
}

void PosedScene::check(const SceneState& state) const {
  if (state.scene != scene_) {
    throw std::invalid_argument("scene state belongs to '" + state.scene + "', this renderer draws '" +
                                scene_ + "'");
  }
  const mjModel& m = *model_;
  check_size("qpos", state.qpos, m.nq);
  check_size("qvel", state.qvel, m.nv);
  check_size("act", state.act, m.na);
  check_size("ctrl", state.ctrl, m.nu);
  check_size("mocap_pos", state.mocap_pos, 3 * m.nmocap);
  check_size("mocap_quat", state.mocap_quat, 4 * m.nmocap);
  check_size("eq_active", state.eq_active, m.neq);
  check_size("eq_data", state.eq_data, mjNEQDATA * m.neq);
  check_size("mat_rgba", state.mat_rgba, 4 * m.nmat);
  check_finite("qpos", state.qpos);
  check_finite("mocap_pos", state.mocap_pos);
  check_finite("mocap_quat", state.mocap_quat);
}

void PosedScene::apply(const SceneState& state) {
  check(state);
  mjModel* m = model_.get();
  mjData* d = data_.get();
  d->time = state.time_s;
  std::copy(state.qpos.begin(), state.qpos.end(), d->qpos);
  std::copy(state.qvel.begin(), state.qvel.end(), d->qvel);
  std::copy(state.act.begin(), state.act.end(), d->act);
  std::copy(state.ctrl.begin(), state.ctrl.end(), d->ctrl);
  std::copy(state.mocap_pos.begin(), state.mocap_pos.end(), d->mocap_pos);
  std::copy(state.mocap_quat.begin(), state.mocap_quat.end(), d->mocap_quat);
  std::copy(state.eq_active.begin(), state.eq_active.end(), m->eq_active);
  std::copy(state.eq_data.begin(), state.eq_data.end(), m->eq_data);
  std::copy(state.mat_rgba.begin(), state.mat_rgba.end(), m->mat_rgba);
  // The position-dependent stages that drawing needs; no dynamics.
  mj_kinematics(m, d);
  mj_comPos(m, d);
  mj_camlight(m, d);
}

CameraModel PosedScene::camera(const std::string& name, int width, int height) const {
  const mjModel* m = model_.get();
  const int id = mj_name2id(m, mjOBJ_CAMERA, name.c_str());
  if (id < 0) {
    std::string known;
    for (int i = 0; i < m->ncam; ++i)
      known += (i > 0 ? ", " : "") + std::string(m->names + m->name_camadr[i]);
    throw std::invalid_argument("no camera '" + name + "' in scene '" + scene_ + "'; known: " + known);
  }
  const double* p = data_->cam_xpos + 3 * id;
  const Eigen::Matrix3d world_from_mujoco =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(data_->cam_xmat + 9 * id);
  // MuJoCo looks along -z with y up; CameraModel along +z with y down.
  const Eigen::Matrix3d world_from_camera = world_from_mujoco * Eigen::Vector3d(1, -1, -1).asDiagonal();
  const Pose pose{{p[0], p[1], p[2]}, Eigen::Quaterniond(world_from_camera).normalized()};
  const double fovy_rad = m->cam_fovy[id] * std::numbers::pi / 180;
  CameraModel camera = CameraModel::from_vertical_fov(name, width, height, fovy_rad, pose);
  camera.near_m = m->vis.map.znear * m->stat.extent;
  camera.far_m = m->vis.map.zfar * m->stat.extent;
  return camera;
}

}  // namespace flowscope
