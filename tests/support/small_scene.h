// Small scenes written in place as MJCF text, for any test that needs a model.
#pragma once

#include <mujoco/mujoco.h>

#include <array>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <string>

#include "render/mujoco_handles.h"
#include "render/scene_state.h"

namespace flowscope::testing {

struct VfsDeleter {
  void operator()(mjVFS* vfs) const {
    mj_deleteVFS(vfs);
    delete vfs;
  }
};

/// Compiles MJCF text; throws std::runtime_error with the compiler's message.
inline ModelPtr compile(const std::string& mjcf) {
  std::unique_ptr<mjVFS, VfsDeleter> vfs(new mjVFS);  // 2 MB: not for the stack
  mj_defaultVFS(vfs.get());
  mj_makeEmptyFileVFS(vfs.get(), "scene.xml", static_cast<int>(mjcf.size()));
  std::memcpy(vfs->filedata[0], mjcf.data(), mjcf.size());
  std::array<char, 500> error{};
  ModelPtr model(mj_loadXML("scene.xml", vfs.get(), error.data(), static_cast<int>(error.size())));
  if (!model) throw std::runtime_error(error.data());
  return model;
}

/// The initial state, as a recorder would take it.
inline SceneState initial_state(const mjModel* model, const std::string& scene) {
  const DataPtr data(mj_makeData(model));
  mj_forward(model, data.get());
  SceneState state;
  state.scene = scene;
  state.qpos.assign(data->qpos, data->qpos + model->nq);
  state.qvel.assign(data->qvel, data->qvel + model->nv);
  state.act.assign(data->act, data->act + model->na);
  state.ctrl.assign(data->ctrl, data->ctrl + model->nu);
  state.qacc_warmstart.assign(data->qacc_warmstart, data->qacc_warmstart + model->nv);
  state.mocap_pos.assign(data->mocap_pos, data->mocap_pos + 3 * model->nmocap);
  state.mocap_quat.assign(data->mocap_quat, data->mocap_quat + 4 * model->nmocap);
  state.eq_active.assign(model->eq_active, model->eq_active + model->neq);
  state.eq_data.assign(model->eq_data, model->eq_data + mjNEQDATA * model->neq);
  state.mat_rgba.assign(model->mat_rgba, model->mat_rgba + 4 * model->nmat);
  return state;
}

}  // namespace flowscope::testing
