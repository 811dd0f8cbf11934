#include "recorder/robot_ties.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace flowscope {
namespace {

bool is_scalar(const mjModel* model, int joint) {
  return model->jnt_type[joint] == mjJNT_HINGE || model->jnt_type[joint] == mjJNT_SLIDE;
}

std::vector<int> bodies_above(const mjModel* model, int body) {
  std::vector<int> bodies;
  for (; body != 0; body = model->body_parentid[body]) bodies.push_back(body);
  return bodies;
}

}  // namespace

JointTies::JointTies(const mjModel* model)
    : model_(model),
      parent_(static_cast<std::size_t>(model->njnt)),
      locked_(static_cast<std::size_t>(model->njnt)) {
  std::iota(parent_.begin(), parent_.end(), 0);
  if (model->opt.disableflags & (mjDSBL_EQUALITY | mjDSBL_CONSTRAINT)) return;
  for (int i = 0; i < model->neq; ++i) {
    if (!model->eq_active[i]) continue;
    const int first = model->eq_obj1id[i], second = model->eq_obj2id[i];
    const mjtNum* slopes = model->eq_data + mjNEQDATA * i + 1;
    switch (model->eq_type[i]) {
      case mjEQ_JOINT:
        if (second < 0 || std::all_of(slopes, slopes + 4, [](mjtNum slope) { return slope == 0; })) {
          locked_[static_cast<std::size_t>(first)] = true;
        } else {
          unite(first, second);
          follows_.push_back({first, second, i});
        }
        break;
      case mjEQ_CONNECT:
      case mjEQ_WELD:
        unite_linkage(first, std::max(second, 0));
        break;
      case mjEQ_TENDON: {
        int joint = -1;
        unite_tendon(first, joint);
        if (second >= 0) unite_tendon(second, joint);
        break;
      }
      default:
        break;
    }
  }
}

bool JointTies::is_tied(int joint) const {
  for (int other = 0; other < model_->njnt; ++other) {
    if (other != joint && tied(joint, other)) return true;
  }
  return false;
}

int JointTies::find(int joint) const {
  while (parent_[static_cast<std::size_t>(joint)] != joint) joint = parent_[static_cast<std::size_t>(joint)];
  return joint;
}

void JointTies::unite(int joint1, int joint2) {
  parent_[static_cast<std::size_t>(find(joint1))] = find(joint2);
}

/// The loop that the constraint closes: both ways up to the body that they have in common. A body that is
/// free closes none: it goes along.
void JointTies::unite_linkage(int body1, int body2) {
  const auto one = bodies_above(model_, body1), two = bodies_above(model_, body2);
  std::vector<int> joints;
  for (const auto* way : {&one, &two}) {
    const auto& other = way == &one ? two : one;
    for (const int body : *way) {
      if (std::ranges::find(other, body) != other.end()) break;
      for (int k = 0; k < model_->body_jntnum[body]; ++k) {
        const int joint = model_->body_jntadr[body] + k;
        if (model_->jnt_type[joint] == mjJNT_FREE) return;
        if (is_scalar(model_, joint)) joints.push_back(joint);
      }
    }
  }
  for (const int joint : joints) unite(joint, joints.front());
}

void JointTies::unite_tendon(int tendon, int& first) {
  for (int i = 0; i < model_->tendon_num[tendon]; ++i) {
    const int wrap = model_->tendon_adr[tendon] + i;
    if (model_->wrap_type[wrap] != mjWRAP_JOINT) continue;
    const int joint = model_->wrap_objid[wrap];
    if (first >= 0) unite(joint, first);
    first = joint;
  }
}

/// Where the follower belongs; both joints count from where the model has them at first.
double JointTies::followed(const Follow& follow, const double* qpos) const {
  const mjtNum* c = model_->eq_data + mjNEQDATA * follow.equality;
  const int leader = model_->jnt_qposadr[follow.leader], follower = model_->jnt_qposadr[follow.follower];
  const double x = qpos[leader] - model_->qpos0[leader];
  return model_->qpos0[follower] + c[0] + x * (c[1] + x * (c[2] + x * (c[3] + x * c[4])));
}

void JointTies::spread(std::vector<bool>& known, double* qpos) const {
  for (bool more = true; more;) {
    more = false;
    for (const Follow& follow : follows_) {
      const auto follower = static_cast<std::size_t>(follow.follower);
      const auto leader = static_cast<std::size_t>(follow.leader);
      if (known[follower] == known[leader]) continue;
      const int at = model_->jnt_qposadr[follow.follower], from = model_->jnt_qposadr[follow.leader];
      if (known[leader]) {
        qpos[at] = followed(follow, qpos);
      } else {
        const mjtNum* c = model_->eq_data + mjNEQDATA * follow.equality;
        if (c[1] == 0 || c[2] != 0 || c[3] != 0 || c[4] != 0) continue;
        qpos[from] = model_->qpos0[from] + (qpos[at] - model_->qpos0[at] - c[0]) / c[1];
      }
      known[follower] = known[leader] = more = true;
    }
  }
}

double JointTies::gap(int joint, int leader, const double* qpos) const {
  for (const Follow& follow : follows_) {
    if (follow.follower == joint && follow.leader == leader) {
      return qpos[model_->jnt_qposadr[joint]] - followed(follow, qpos);
    }
  }
  return 0;
}

}  // namespace flowscope
