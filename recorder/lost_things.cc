#include "recorder/lost_things.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <cstdio>

#include "recorder/world.h"

namespace flowscope {
namespace {

constexpr double kFarther_m = 0.25, kLower_m = 0.4;

double distance_outside(const Box& box, const Eigen::Vector3d& p) {
  return (box.min - p).cwiseMax(p - box.max).cwiseMax(0.0).norm();
}

Eigen::Vector3d position_of(const std::vector<double>& qpos, int address) {
  return Eigen::Map<const Eigen::Vector3d>(qpos.data() + address);
}

}  // namespace

std::vector<std::string> lost_things(const World& world, const SceneState& start) {
  const mjModel* model = world.model();
  const SceneState now = world.state();
  if (now.qpos.size() != start.qpos.size()) return {};
  const Box workspace = world.task().bounds();
  std::vector<std::string> lost;
  for (int joint = 0; joint < model->njnt; ++joint) {
    if (model->jnt_type[joint] != mjJNT_FREE) continue;
    const int address = model->jnt_qposadr[joint];
    const Eigen::Vector3d before = position_of(start.qpos, address), after = position_of(now.qpos, address);
    const double outside = distance_outside(workspace, after), lower = before.z() - after.z();
    if (outside - distance_outside(workspace, before) < kFarther_m && lower < kLower_m) continue;
    const char* name = mj_id2name(model, mjOBJ_BODY, model->jnt_bodyid[joint]);
    char text[200];
    std::snprintf(text, sizeof text,
                  "%s has left the workspace: %.2f m outside, %.2f m lower than at the start",
                  name && *name ? name : "a thing without a name", outside, std::max(lower, 0.0));
    lost.emplace_back(text);
  }
  return lost;
}

std::string lost_text(const World& world, const SceneState& start) {
  std::string text;
  for (const std::string& thing : lost_things(world, start)) text += "; " + thing;
  return text;
}

}  // namespace flowscope
