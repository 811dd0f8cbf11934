#include "recorder/motion/collision.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <utility>
#include <vector>

#include "recorder/motion/geom_bounds.h"
#include "recorder/motion/moving_parts.h"
#include "recorder/world.h"
#include "render/mujoco_owners.h"

namespace flowscope {
namespace {

using Eigen::Vector3d;

constexpr double kTolerance_m = 0.001;

std::string name_of(const mjModel* model, int geom) {
  // Bodies are what people know; a geom's name is the finer word where the body is the world itself.
  for (int body = model->geom_bodyid[geom]; body != 0; body = model->body_parentid[body]) {
    if (const char* name = mj_id2name(model, mjOBJ_BODY, body)) return name;
  }
  const char* name = mj_id2name(model, mjOBJ_GEOM, geom);
  return name ? name : "the scene";
}

/// Whether the engine would ask whether two geoms touch: its own filters, in its own words.
bool engine_compares(const mjModel* model, int geom1, int geom2) {
  const int body1 = model->geom_bodyid[geom1], body2 = model->geom_bodyid[geom2];
  const int weld1 = model->body_weldid[body1], weld2 = model->body_weldid[body2];
  if (weld1 == weld2) return false;
  const bool parents_count = !(model->opt.disableflags & mjDSBL_FILTERPARENT);
  const int above1 = model->body_weldid[model->body_parentid[weld1]];
  const int above2 = model->body_weldid[model->body_parentid[weld2]];
  if (parents_count && weld1 != 0 && weld2 != 0 && (weld1 == above2 || weld2 == above1)) return false;
  const int signature = ((std::min(body1, body2) + 1) << 16) + std::max(body1, body2) + 1;
  const int* excluded = model->exclude_signature;
  if (std::find(excluded, excluded + model->nexclude, signature) != excluded + model->nexclude) return false;
  return (model->geom_contype[geom1] & model->geom_conaffinity[geom2]) != 0 ||
         (model->geom_contype[geom2] & model->geom_conaffinity[geom1]) != 0;
}

bool gives_way(const mjModel* model, int body) {
  while (body != 0 && model->body_dofnum[body] == 0) body = model->body_parentid[body];
  return body != 0;
}

}  // namespace

struct CollisionChecker::Impl {
  enum class Asked { all, all_and_clearance, links, all_but_pushed };

  /// Two geoms that might touch while the arm moves; at least the first one moves.
  struct Pair {
    int moving = 0, other = 0;
    bool other_moves = false;
    bool links = false;   ///< neither is of the hand or held
    bool pushed = false;  ///< the hand, or what it holds, and a thing that gives way
    double margin = 0, allowed_m = 0;
    bool carried = false;     ///< by the hand, past what stands still
    double clearance_m = 0;   ///< to be kept by what is carried: as far as it is kept at the start
    GeomBounds other_bounds;  ///< where the other stands still
  };

  explicit Impl(const World& world)
      : model(world.model()),
        data(up_to_date(world)),
        arm(find_arm(model, world.task().robot())),
        parts(model, data.get(), arm, world.grasped()) {
    find_pairs();
    JointVector start{};
    for (std::size_t i = 0; i < arm.joints; ++i) start[i] = data->qpos[arm.qpos[i]];
    allow_as_at(start);
  }

  void allow_as_at(const JointVector& q) {
    parts.place(q, data.get());
    for (Pair& pair : pairs) {
      pair.clearance_m = 0;
      if (pair.carried) {
        const double distance = deepest(pair, carried_clearance_m);
        pair.clearance_m = std::clamp(distance - clear_depth_m, 0.0, carried_clearance_m);
      }
      pair.allowed_m = std::max(0.0, -deepest(pair));
    }
  }

  static DataPtr up_to_date(const World& world) {
    DataPtr copy(mj_copyData(nullptr, world.model(), world.data()));
    mj_kinematics(world.model(), copy.get());
    return copy;
  }

  void find_pairs() {
    const auto add = [&](int geom1, int geom2, double margin) {
      const int body1 = model->geom_bodyid[geom1], body2 = model->geom_bodyid[geom2];
      if (!parts.moves(body1) && !parts.moves(body2)) return;
      if (parts.in_hand(body1) && parts.in_hand(body2)) return;
      const auto [low, high] = std::minmax(model->geom_type[geom1], model->geom_type[geom2]);
      if (!mjCOLLISIONFUNC[low][high]) return;
      Pair pair;
      pair.moving = parts.moves(body1) ? geom1 : geom2;
      pair.other = parts.moves(body1) ? geom2 : geom1;
      pair.other_moves = parts.moves(body1) && parts.moves(body2);
      pair.links = !parts.in_hand(body1) && !parts.in_hand(body2);
      pair.pushed = !pair.links && !pair.other_moves && gives_way(model, model->geom_bodyid[pair.other]);
      pair.margin = margin;
      pair.carried = !pair.other_moves && parts.carried(model->geom_bodyid[pair.moving]);
      if (!pair.other_moves) pair.other_bounds = geom_bounds(model, data.get(), pair.other);
      pairs.push_back(pair);
    };
    std::set<std::pair<int, int>> named;
    if (model->opt.collision != mjCOL_DYNAMIC) {
      for (int i = 0; i < model->npair; ++i) {
        const auto [low, high] = std::minmax(model->pair_geom1[i], model->pair_geom2[i]);
        named.insert({low, high});
        add(low, high, model->pair_margin[i]);
      }
    }
    if (model->opt.collision == mjCOL_PAIR) return;
    for (const auto& geom : parts.geoms()) {
      for (int other = 0; other < model->ngeom; ++other) {
        if (parts.moves(model->geom_bodyid[other]) && other <= geom.id) continue;  // each pair once
        if (named.contains({std::min(geom.id, other), std::max(geom.id, other)})) continue;
        if (!engine_compares(model, geom.id, other)) continue;
        add(geom.id, other, std::max(model->geom_margin[geom.id], model->geom_margin[other]));
      }
    }
  }

  bool may_touch(const Pair& pair, double margin) const {
    const Vector3d center = Eigen::Map<const Vector3d>(data->geom_xpos + 3 * pair.moving);
    const double radius = model->geom_rbound[pair.moving] + margin;
    if (model->geom_rbound[pair.moving] <= 0) return true;
    if (!pair.other_moves) return pair.other_bounds.within(center, radius);
    const double reach = radius + model->geom_rbound[pair.other];
    const Vector3d apart = Eigen::Map<const Vector3d>(data->geom_xpos + 3 * pair.other) - center;
    return apart.squaredNorm() <= reach * reach;
  }

  /// Distance at the deepest contact, metres, negative inside each other; infinite where they are farther
  /// apart than the pair's margin, or than `least_margin`.
  double deepest(const Pair& pair, double least_margin = 0) {
    const double margin = std::max(pair.margin, least_margin);
    double distance = std::numeric_limits<double>::infinity();
    if (!may_touch(pair, margin)) return distance;
    int geom1 = pair.moving, geom2 = pair.other;
    if (model->geom_type[geom1] > model->geom_type[geom2]) std::swap(geom1, geom2);
    const mjfCollision collide = mjCOLLISIONFUNC[model->geom_type[geom1]][model->geom_type[geom2]];
    const int count = collide(model, data.get(), contacts.data(), geom1, geom2, margin);
    for (int i = 0; i < count; ++i) distance = std::min(distance, contacts[static_cast<std::size_t>(i)].dist);
    return distance;
  }

  /// How far beyond what is allowed, metres; <= 0 when it is no collision.
  double excess(const Pair& pair, double tolerance_m) {
    return -deepest(pair) - pair.allowed_m - tolerance_m;
  }

  bool is_free(const JointVector& q, double tolerance_m, Asked asked = Asked::all) {
    parts.place(q, data.get());
    const auto collides = [&](const Pair& pair) {
      if (asked == Asked::links && !pair.links) return false;
      if (asked == Asked::all_but_pushed && pair.pushed) return false;
      if (asked == Asked::all_and_clearance && pair.clearance_m > 0)
        return deepest(pair, pair.clearance_m) < pair.clearance_m;
      return excess(pair, tolerance_m) > 0;
    };
    // Neighbouring postures mostly collide in the same place.
    if (last_hit < pairs.size() && collides(pairs[last_hit])) return false;
    const auto hit = std::ranges::find_if(pairs, collides);
    if (hit == pairs.end()) return true;
    last_hit = static_cast<std::size_t>(hit - pairs.begin());
    return false;
  }

  const mjModel* model;
  DataPtr data;
  ArmIndices arm;
  MovingParts parts;
  std::vector<Pair> pairs;
  std::array<mjContact, mjMAXCONPAIR> contacts;
  std::size_t last_hit = 0;
};

CollisionChecker::CollisionChecker(const World& world) : impl_(std::make_unique<Impl>(world)) {}
CollisionChecker::~CollisionChecker() = default;

bool CollisionChecker::is_free(const JointVector& q) { return impl_->is_free(q, kTolerance_m); }
bool CollisionChecker::is_clear(const JointVector& q, double depth_m) { return impl_->is_free(q, depth_m); }
bool CollisionChecker::carries_clear(const JointVector& q) {
  return impl_->is_free(q, clear_depth_m, Impl::Asked::all_and_clearance);
}
bool CollisionChecker::carries() const { return impl_->parts.carries_anything(); }
bool CollisionChecker::links_are_free(const JointVector& q) {
  return impl_->is_free(q, kTolerance_m, Impl::Asked::links);
}
bool CollisionChecker::is_free_to_push(const JointVector& q) {
  return impl_->is_free(q, kTolerance_m, Impl::Asked::all_but_pushed);
}
bool CollisionChecker::touches(const JointVector& q) {
  impl_->parts.place(q, impl_->data.get());
  return std::ranges::any_of(impl_->pairs,
                             [&](const Impl::Pair& pair) { return impl_->deepest(pair) <= pair.margin; });
}

void CollisionChecker::start_from(const JointVector& q) { impl_->allow_as_at(q); }

std::string CollisionChecker::describe(const JointVector& q) {
  impl_->parts.place(q, impl_->data.get());
  const Impl::Pair* worst = nullptr;
  double worst_excess = 0;
  for (const auto& pair : impl_->pairs) {
    const double excess = impl_->excess(pair, clear_depth_m);
    if (excess > worst_excess) worst = &pair, worst_excess = excess;
  }
  if (!worst) return "";
  const double depth_mm = std::ceil(-impl_->deepest(*worst) * 1000);
  return name_of(impl_->model, worst->moving) + " and " + name_of(impl_->model, worst->other) + ", " +
         std::to_string(static_cast<int>(depth_mm)) + " mm deep";
}

}  // namespace flowscope
