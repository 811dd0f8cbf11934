#include "recorder/floor.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <vector>

#include "recorder/motion/moving_parts.h"
#include "render/mujoco_owners.h"

namespace flowscope {
namespace {

constexpr double kLevel = 0.999;  ///< least z of an upright plane's normal
constexpr double kTolerance_m = 0.001;
/// Above the floor; a fall from a table covers 0.2 m in a frame.
constexpr double kNear_m = 0.4;
constexpr int kBits = 31;  ///< of a geom's masks

bool can_touch(const mjModel* model, int geom) {
  return (model->geom_contype[geom] | model->geom_conaffinity[geom]) != 0;
}

bool is_loose(const mjModel* model, int body) {
  for (; body != 0; body = model->body_parentid[body]) {
    if (goes_anywhere(model, body)) return true;
  }
  return false;
}

bool is_only_seen(const mjModel* model, const mjData* data, int geom) {
  return model->geom_type[geom] == mjGEOM_PLANE && !can_touch(model, geom) &&
         model->body_weldid[model->geom_bodyid[geom]] == 0 && data->geom_xmat[9 * geom + 8] > kLevel;
}

/// One that no geom uses; 0: all are taken.
int free_bit(const mjModel* model) {
  int used = 0;
  for (int i = 0; i < model->ngeom; ++i) used |= model->geom_contype[i] | model->geom_conaffinity[i];
  for (int k = kBits - 1; k > 0; --k) {
    if ((used & (1 << k)) == 0) return 1 << k;
  }
  return 0;
}

}  // namespace

Floor::Floor(mjModel* model) : bit_(free_bit(model)) {
  const DataPtr data(mj_makeData(model));
  mj_kinematics(model, data.get());
  double lowest = 1e9;
  for (int i = 0; i < model->ngeom; ++i) {
    if (!can_touch(model, i)) continue;
    lowest = std::min(lowest, data->geom_xpos[3 * i + 2]);
    if (is_loose(model, model->geom_bodyid[i])) loose_.push_back(i);
  }
  if (loose_.empty() || bit_ == 0) return;
  for (int i = 0; i < model->ngeom; ++i) {
    if (is_only_seen(model, data.get(), i) && lowest > data->geom_xpos[3 * i + 2] - kTolerance_m)
      planes_.push_back(i);
  }
  if (planes_.empty()) return;
  for (const int geom : loose_) model->geom_conaffinity[geom] |= bit_;
  for (const int plane : planes_) {
    model->geom_condim[plane] = 6;               // what is round comes to rest
    const mjtNum friction[3] = {1, 0.02, 0.01};  // sliding, metres of turning and of rolling
    std::copy_n(friction, 3, model->geom_friction + 3 * plane);
  }
}

void Floor::watch(mjModel* model, const mjData* data) const {
  for (const int plane : planes_) {
    const double height = data->geom_xpos[3 * plane + 2] + kNear_m;
    const bool is_near = std::ranges::any_of(
        loose_, [&](int geom) { return data->geom_xpos[3 * geom + 2] - model->geom_rbound[geom] < height; });
    model->geom_contype[plane] = is_near ? bit_ : 0;
  }
}

}  // namespace flowscope
