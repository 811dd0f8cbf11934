#include "recorder/scene_start.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <iterator>
#include <stdexcept>

namespace flowscope {
namespace {

/// A nameless one is called by its number.
std::string name_of(const mjModel* scene, int key) {
  const char* name = mj_id2name(scene, mjOBJ_KEY, key);
  return name && *name ? name : std::to_string(key);
}

int find_key(const mjModel* scene, const std::string& key) {
  if (const int named = mj_name2id(scene, mjOBJ_KEY, key.c_str()); named >= 0) return named;
  std::string known;
  for (int i = 0; i < scene->nkey; ++i) {
    if (key == std::to_string(i)) return i;
    known += (i == 0 ? "" : ", ") + name_of(scene, i);
  }
  throw std::runtime_error("--key: there is no key frame '" + key + "' in it (" +
                           (known.empty() ? "it has none" : "known: " + known) + ")");
}

std::vector<double> row(const mjtNum* values, int index, int width) {
  return {values + index * width, values + (index + 1) * width};
}

bool any(const std::vector<double>& values) {
  return std::ranges::any_of(values, [](double value) { return value != 0; });
}

}  // namespace

StartState start_state(const mjModel* scene, const mjModel* model, const std::string& key) {
  StartState start;
  start.qpos.assign(model->qpos0, model->qpos0 + model->nq);
  if (scene->nkey == 0 && key.empty()) return start;
  const int index = key.empty() ? 0 : find_key(scene, key);
  if (scene->nq != model->nq || scene->nv != model->nv || scene->na != model->na || scene->nu > model->nu ||
      scene->nmocap != model->nmocap) {
    throw std::runtime_error("its key frame '" + name_of(scene, index) + "' does not fit what it became");
  }
  start.qpos = row(scene->key_qpos, index, scene->nq);
  start.qvel = row(scene->key_qvel, index, scene->nv);
  start.act = row(scene->key_act, index, scene->na);
  start.ctrl.resize(static_cast<std::size_t>(scene->na > 0 ? model->nu - scene->nu : 0));  // added ones
  std::ranges::copy(row(scene->key_ctrl, index, scene->nu), std::back_inserter(start.ctrl));
  start.mocap_pos = row(scene->key_mpos, index, 3 * scene->nmocap);
  start.mocap_quat = row(scene->key_mquat, index, 4 * scene->nmocap);
  start.moves = any(start.qvel) || any(start.act);
  return start;
}

void begin_with(const StartState& start, mjData* data) {
  std::ranges::copy(start.qpos, data->qpos);
  std::ranges::copy(start.qvel, data->qvel);
  std::ranges::copy(start.act, data->act);
  std::ranges::copy(start.ctrl, data->ctrl);
  std::ranges::copy(start.mocap_pos, data->mocap_pos);
  std::ranges::copy(start.mocap_quat, data->mocap_quat);
}

}  // namespace flowscope
