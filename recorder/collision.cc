#include "recorder/collision.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "recorder/world.h"
#include "render/mujoco_owners.h"

namespace flowscope {
namespace {

constexpr double kTolerance_m = 0.001;

Pose body_pose(const mjData* data, int body) {
  const double* p = data->xpos + 3 * body;
  const double* r = data->xquat + 4 * body;
  return Pose::from_wxyz({p[0], p[1], p[2]}, {r[0], r[1], r[2], r[3]});
}

bool is_below(const mjModel* model, int body, int ancestor) {
  while (body != 0 && body != ancestor) body = model->body_parentid[body];
  return body == ancestor;
}

std::string name_of(const mjModel* model, int geom) {
  // Bodies are what people know; a geom's name is the finer word where the body is the world itself.
  for (int body = model->geom_bodyid[geom]; body != 0; body = model->body_parentid[body]) {
    if (const char* name = mj_id2name(model, mjOBJ_BODY, body)) return name;
  }
  const char* name = mj_id2name(model, mjOBJ_GEOM, geom);
  return name ? name : "the scene";
}

}  // namespace

struct CollisionChecker::Impl {
  struct Held {
    int qpos = 0;  ///< of its free joint
    Pose hand_from_body;
  };
  using GeomPair = std::pair<int, int>;

  explicit Impl(const World& world)
      : model(world.model()),
        data(mj_copyData(nullptr, model, world.data())),
        arm(find_arm(model, world.task().robot())),
        hand(arm.hand) {
    const int first_link = model->jnt_bodyid[arm.joint[0]];
    moves.resize(model->nbody);
    in_hand.resize(model->nbody);
    for (int body = 1; body < model->nbody; ++body) {
      moves[body] = is_below(model, body, first_link);
      in_hand[body] = is_below(model, body, hand);
    }
    mj_kinematics(model, data.get());
    for (const auto& name : world.grasped()) hold(mj_name2id(model, mjOBJ_BODY, name.c_str()));

    JointVector start{};
    for (std::size_t i = 0; i < arm.joints; ++i) start[i] = data->qpos[arm.qpos[i]];
    collide(start);
    for (int i = 0; i < data->ncon; ++i) {
      const mjContact& contact = data->contact[i];
      if (!concerns_robot(contact)) continue;
      double& depth = depth_at_start[{contact.geom1, contact.geom2}];
      depth = std::max(depth, -contact.dist);
    }
  }

  /// A held body goes along with the hand. One that hangs on its own joints (a drawer) cannot; it may only
  /// touch the hand.
  void hold(int body) {
    if (body < 0) return;
    for (int other = 1; other < model->nbody; ++other) {
      if (is_below(model, other, body)) in_hand[other] = true;
    }
    const int joint = model->body_jntadr[body];
    if (joint < 0 || model->jnt_type[joint] != mjJNT_FREE) return;
    held.push_back(
        {model->jnt_qposadr[joint], body_pose(data.get(), hand).inverse() * body_pose(data.get(), body)});
    for (int other = 1; other < model->nbody; ++other) {
      if (is_below(model, other, body)) moves[other] = true;
    }
  }

  void collide(const JointVector& q) {
    for (std::size_t i = 0; i < arm.joints; ++i) data->qpos[arm.qpos[i]] = q[i];
    mj_kinematics(model, data.get());
    if (!held.empty()) {
      const Pose world_from_hand = body_pose(data.get(), hand);
      for (const auto& body : held) {
        const Pose world_from_body = world_from_hand * body.hand_from_body;
        const Eigen::Vector4d wxyz = world_from_body.wxyz();
        std::copy_n(world_from_body.position.data(), 3, data->qpos + body.qpos);
        std::copy_n(wxyz.data(), 4, data->qpos + body.qpos + 3);
      }
      mj_kinematics(model, data.get());
    }
    mj_comPos(model, data.get());
    mj_collision(model, data.get());
  }

  bool concerns_robot(const mjContact& contact) const {
    const int body1 = model->geom_bodyid[contact.geom1], body2 = model->geom_bodyid[contact.geom2];
    return (moves[body1] || moves[body2]) && !(in_hand[body1] && in_hand[body2]);
  }

  /// How far beyond what is allowed, metres; <= 0 when the contact is no collision.
  double excess(const mjContact& contact) const {
    if (!concerns_robot(contact)) return 0;
    const auto known = depth_at_start.find({contact.geom1, contact.geom2});
    const double allowed = known == depth_at_start.end() ? 0 : known->second;
    return -contact.dist - std::max(allowed, 0.0) - kTolerance_m;
  }

  const mjModel* model;
  DataPtr data;
  ArmIndices arm;
  int hand = 0;
  std::vector<char> moves, in_hand;  ///< per body
  std::vector<Held> held;
  std::map<GeomPair, double> depth_at_start;  ///< metres
};

CollisionChecker::CollisionChecker(const World& world) : impl_(std::make_unique<Impl>(world)) {}
CollisionChecker::~CollisionChecker() = default;

bool CollisionChecker::is_free(const JointVector& q) {
  impl_->collide(q);
  const auto* contacts = impl_->data->contact;
  return std::none_of(contacts, contacts + impl_->data->ncon,
                      [&](const mjContact& contact) { return impl_->excess(contact) > 0; });
}

bool CollisionChecker::touches_at_start() const { return !impl_->depth_at_start.empty(); }
void CollisionChecker::forget_start() { impl_->depth_at_start.clear(); }

std::string CollisionChecker::describe(const JointVector& q) {
  impl_->collide(q);
  const mjContact* worst = nullptr;
  for (int i = 0; i < impl_->data->ncon; ++i) {
    const mjContact& contact = impl_->data->contact[i];
    const double excess = impl_->excess(contact);
    if (excess > 0 && (!worst || excess > impl_->excess(*worst))) worst = &contact;
  }
  if (!worst) return "";
  const double depth_mm = std::ceil(-worst->dist * 1000);
  return name_of(impl_->model, worst->geom1) + " and " + name_of(impl_->model, worst->geom2) + ", " +
         std::to_string(static_cast<int>(depth_mm)) + " mm deep";
}

}  // namespace flowscope
