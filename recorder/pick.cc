#include "recorder/pick.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "recorder/motion/kinematics.h"
#include "recorder/world.h"

namespace flowscope {
namespace {

using RowMatrix = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

constexpr std::array<mjtByte, mjNGROUP> kShown{1, 1, 1, 0, 0, 0};  ///< groups that pictures show
constexpr double kPointedAt_m = 0.15;
constexpr double kClearance_m =
    0.004;                         ///< of the tool point before the surface: the fingers end 2 mm beyond it
constexpr double kAligned = 0.98;  ///< cosine: two directions that count as the same

struct Hit {
  double distance = -1;  ///< in lengths of the ray's direction; negative: nothing
  int geom = -1;
};

Hit cast(const World& world, const Eigen::Vector3d& from, const Eigen::Vector3d& direction,
         int without = -1) {
  Hit hit;
  hit.distance = mj_ray(world.model(), world.data(), from.data(), direction.data(), kShown.data(), 1, without,
                        &hit.geom);
  return hit;
}

Eigen::Vector3d ray_of(const CameraModel& camera, double u, double v) {
  return camera.unproject(u, v, 1) - camera.world_from_camera.position;
}

std::string name_of(const mjModel* model, mjtObj type, int id) {
  const char* name = mj_id2name(model, type, id);
  return name ? name : "";
}

/// The body below which the robot hangs; -1 in a scene without one.
int root_of_robot(const World& world) {
  const RobotDescription& robot = world.task().robot();
  return robot.joints.empty() ? -1 : world.model()->body_rootid[find_arm(world.model(), robot).hand];
}

/// The body that a waypoint on `body` follows: the nearest with a name among those that a placement, a joint
/// or a hand can move. "world" when there is none, or when it is the robot itself.
std::string frame_to_follow(const World& world, int body) {
  const mjModel* model = world.model();
  if (model->body_rootid[body] == root_of_robot(world)) return "world";
  std::string frame;
  bool moves = false;
  for (; body != 0; body = model->body_parentid[body]) {
    if (frame.empty()) frame = name_of(model, mjOBJ_BODY, body);
    moves = moves || model->body_jntnum[body] > 0 || model->body_mocapid[body] >= 0;
  }
  return moves && !frame.empty() ? frame : "world";
}

/// The rotation whose z lies along `approach` with the least turn from `present`.
Eigen::Quaterniond least_turn(const Eigen::Vector3d& approach, const Eigen::Quaterniond& present) {
  const Eigen::Vector3d z = present * Eigen::Vector3d::UnitZ();
  if (z.dot(approach) < -0.9999) {
    return present * Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX()));
  }
  return (Eigen::Quaterniond::FromTwoVectors(z, approach) * present).normalized();
}

/// The same, with the fingers along an edge when the geom is a box that the tool approaches face on.
Eigen::Quaterniond grip_rotation(const World& world, int geom, const Eigen::Vector3d& approach,
                                 const Eigen::Quaterniond& present) {
  const Eigen::Quaterniond free = least_turn(approach, present);
  if (world.model()->geom_type[geom] != mjGEOM_BOX) return free;
  const RowMatrix axes = Eigen::Map<const RowMatrix>(world.data()->geom_xmat + 9 * geom);
  const Eigen::Vector3d opening = free * Eigen::Vector3d::UnitY();
  Eigen::Vector3d best = Eigen::Vector3d::Zero();
  bool face_on = false;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d edge = axes.col(axis);
    if (std::abs(edge.dot(approach)) > kAligned) {
      face_on = true;
    } else if (std::abs(edge.dot(opening)) > std::abs(best.dot(opening))) {
      best = edge;
    }
  }
  if (!face_on) return free;
  const Eigen::Vector3d y =
      (best - best.dot(approach) * approach).normalized() * (best.dot(opening) < 0 ? -1.0 : 1.0);
  Eigen::Matrix3d rotation;
  rotation << y.cross(approach), y, approach;
  return Eigen::Quaterniond(rotation).normalized();
}

/// Round about the vertical, with its axis through the origin of its frame: any yaw is as good.
bool round_about_frame(const World& world, int geom, const std::string& frame) {
  const int type = world.model()->geom_type[geom];
  if (frame == "world" || (type != mjGEOM_CYLINDER && type != mjGEOM_SPHERE && type != mjGEOM_CAPSULE))
    return false;
  const RowMatrix axes = Eigen::Map<const RowMatrix>(world.data()->geom_xmat + 9 * geom);
  const Pose world_from_frame = world.world_from(frame);
  const Eigen::Vector3d up = world_from_frame.rotation * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d middle =
      world_from_frame.inverse() *
      Eigen::Vector3d(Eigen::Map<const Eigen::Vector3d>(world.data()->geom_xpos + 3 * geom));
  return middle.head<2>().norm() < 1e-3 && std::abs(up.z()) > 0.9999 &&
         (type == mjGEOM_SPHERE || std::abs(axes(2, 2)) > 0.9999);
}

}  // namespace

std::optional<Picked> pick(const World& world, const CameraModel& camera, double u, double v) {
  const Eigen::Vector3d eye = camera.world_from_camera.position;
  const Hit hit = cast(world, eye, ray_of(camera, u, v));
  if (hit.distance < camera.near_m || hit.distance > camera.far_m) return std::nullopt;
  const auto* model = world.model();
  Picked picked;
  picked.depth_m = hit.distance;  // the ray's direction has length 1 along z
  picked.point = camera.unproject(u, v, hit.distance);
  picked.geom_id = hit.geom;
  picked.geom = name_of(model, mjOBJ_GEOM, hit.geom);
  picked.body = name_of(model, mjOBJ_BODY, model->geom_bodyid[hit.geom]);

  // The surface's slope from neighbours on the same geom, a pixel away on either side.
  const auto slope = [&](double du, double dv) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const double side : {-1.0, 1.0}) {
      const Hit near = cast(world, eye, ray_of(camera, u + side * du, v + side * dv));
      if (near.geom != hit.geom || near.distance < 0) continue;
      sum += side * (camera.unproject(u + side * du, v + side * dv, near.distance) - picked.point);
    }
    return sum;
  };
  const Eigen::Vector3d to_camera = (eye - picked.point).normalized();
  const Eigen::Vector3d across = slope(1, 0).cross(slope(0, 1));
  picked.normal = across.norm() > 1e-14 ? Eigen::Vector3d(across.normalized()) : to_camera;
  if (picked.normal.dot(to_camera) < 0) picked.normal = -picked.normal;
  return picked;
}

std::vector<WaypointProposal> propose_waypoints(const World& world, const Picked& picked,
                                                const Pose& present) {
  const mjModel* model = world.model();
  const int body = model->geom_bodyid[picked.geom_id];
  const std::string frame = frame_to_follow(world, body);
  const Eigen::Vector3d down = -Eigen::Vector3d::UnitZ();
  std::vector<WaypointProposal> proposals;
  const auto propose = [&](const std::string& name, const Eigen::Vector3d& point,
                           const Eigen::Vector3d& approach) -> MoveStep& {
    const Pose pose{point - kClearance_m * approach,
                    grip_rotation(world, picked.geom_id, approach, present.rotation)};
    proposals.push_back({name, step_in_frame(world, frame, pose), pose});
    return proposals.back().move;
  };
  propose("above", picked.point, down);
  propose("normal", picked.point, -picked.normal);

  const Eigen::Map<const Eigen::Vector3d> center(world.data()->geom_xpos + 3 * picked.geom_id);
  const double above_m = model->geom_rbound[picked.geom_id] + 0.01;
  const Hit top = cast(world, center + above_m * Eigen::Vector3d::UnitZ(), down);
  if (top.geom >= 0 && model->geom_bodyid[top.geom] == body && above_m > 0.01) {
    MoveStep& middle = propose("middle", center + (above_m - top.distance) * Eigen::Vector3d::UnitZ(), down);
    if (round_about_frame(world, picked.geom_id, frame)) middle.yaw_symmetry = 0;
  }
  return proposals;
}

MoveStep step_at_tool(const World& world) {
  const Pose tool = world.robot().world_from_tool;
  const mjModel* model = world.model();
  const RobotDescription& robot = world.task().robot();
  const int hand = robot.joints.empty() ? -1 : find_arm(model, robot).hand;
  Eigen::Vector3d from = tool.position;
  const Eigen::Vector3d ahead = tool.rotation * Eigen::Vector3d::UnitZ();
  std::string frame = "world";
  // Fingers and what they hold lie in the way; they go along with the tool and are no frame to follow.
  double left_m = kPointedAt_m;
  for (int tries = 0; tries < 8 && left_m > 0; ++tries) {
    const Hit hit = cast(world, from, ahead, hand);
    if (hit.distance < 0 || hit.distance > left_m) break;
    const std::string name = frame_to_follow(world, model->geom_bodyid[hit.geom]);
    const auto held = world.grasped();
    const bool own = model->body_rootid[model->geom_bodyid[hit.geom]] == root_of_robot(world);
    if (!own && std::find(held.begin(), held.end(), name) == held.end()) {
      frame = name;
      break;
    }
    from += (hit.distance + 1e-4) * ahead;
    left_m -= hit.distance + 1e-4;
  }
  return step_in_frame(world, frame, tool);
}

MoveStep step_in_frame(const World& world, const std::string& frame, const Pose& world_from_tool) {
  MoveStep move;
  move.frame = frame;
  move.frame_from_tool = world.world_from(frame).inverse() * world_from_tool;
  return move;
}

std::vector<NamedFrame> scene_frames(const World& world) {
  const mjModel* model = world.model();
  std::vector<NamedFrame> frames{{"world", Pose{}}, {"tool", world.robot().world_from_tool}};
  for (const auto& [type, count] :
       {std::pair{mjOBJ_BODY, model->nbody}, std::pair{mjOBJ_SITE, model->nsite}}) {
    for (int id = type == mjOBJ_BODY ? 1 : 0; id < count; ++id) {
      const std::string name = name_of(model, type, id);
      if (!name.empty() && name != "tool") frames.push_back({name, world.world_from(name)});
    }
  }
  return frames;
}

}  // namespace flowscope
