#include "recorder/task_placement.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <array>
#include <numbers>
#include <stdexcept>

namespace flowscope {
namespace {

constexpr int kTries = 20'000;
// How far from a waypoint the arm comes to rest, metres: what it holds or pushes lies to its side.
const Eigen::Vector3d kTracking{0.003, 0.003, 0.001};
constexpr double kRadPerDeg = std::numbers::pi / 180;

Range read_range(const TaskReader& reader, const TaskNode& map, const std::string& key, double unit) {
  const TaskNode* node = map.find(key);
  if (!node) return {};
  if (node->is_scalar()) {
    const double value = reader.number(*node, key) * unit;
    return {value, value};
  }
  const auto ends = reader.numbers(*node, key, 2);
  if (ends[0] > ends[1]) reader.fail(*node, "'" + key + "' runs from high to low");
  return {ends[0] * unit, ends[1] * unit};
}

/// Address of the body's free joint in qpos, or -1.
int free_joint(const mjModel* model, int body) {
  const int joint = model->body_jntadr[body];
  return joint >= 0 && model->jnt_type[joint] == mjJNT_FREE ? model->jnt_qposadr[joint] : -1;
}

PlacedObject read_object(const TaskReader& reader, const TaskNode& node, const mjModel* model) {
  reader.check_keys(node, "object", {"body", "x", "y", "z", "yaw_deg", "footprint"});
  PlacedObject object;
  const TaskNode& name = reader.require(node, "body");
  object.body = mj_name2id(model, mjOBJ_BODY, reader.text(name, "body").c_str());
  if (object.body < 0) reader.fail(name, "the scene has no body '" + name.text + "'");
  if (model->body_mocapid[object.body] < 0 && free_joint(model, object.body) < 0) {
    reader.fail(name,
                "body '" + name.text + "' can not be placed: it is neither mocap nor has it a free joint");
  }
  object.x = read_range(reader, node, "x", 1);
  object.y = read_range(reader, node, "y", 1);
  object.z = read_range(reader, node, "z", 1);
  object.yaw = read_range(reader, node, "yaw_deg", kRadPerDeg);
  if (const auto* footprint = node.find("footprint")) {
    const auto sides = reader.numbers(*footprint, "footprint", 2);
    if (sides[0] <= 0 || sides[1] <= 0) reader.fail(*footprint, "'footprint' needs two sides above 0");
    object.footprint_x = sides[0];
    object.footprint_y = sides[1];
  }
  return object;
}

Pose planar(double x, double y, double z, double yaw) {
  return {{x, y, z}, Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()))};
}

void set_pose(const mjModel* model, mjData* data, int body, const Pose& world_from_body) {
  const int mocap = model->body_mocapid[body];
  const int address = free_joint(model, body);
  mjtNum* position = mocap >= 0 ? data->mocap_pos + 3 * mocap : data->qpos + address;
  mjtNum* quaternion = mocap >= 0 ? data->mocap_quat + 4 * mocap : position + 3;
  const Eigen::Vector4d wxyz = world_from_body.wxyz();
  std::copy_n(world_from_body.position.data(), 3, position);
  std::copy_n(wxyz.data(), 4, quaternion);
}

std::array<Eigen::Vector2d, 4> corners(const Footprint& f) {
  const Eigen::Rotation2Dd turn(f.yaw);
  std::array<Eigen::Vector2d, 4> result;
  const double signs[4][2] = {{1, 1}, {-1, 1}, {-1, -1}, {1, -1}};
  for (std::size_t i = 0; i < 4; ++i) {
    result[i] = f.center + turn * Eigen::Vector2d(signs[i][0] * f.half_x, signs[i][1] * f.half_y);
  }
  return result;
}

/// All corners over the scene's geom `table_top`, as far as there is one.
bool on_table(const mjModel* model, const mjData* data, const Footprint& footprint) {
  const int geom = mj_name2id(model, mjOBJ_GEOM, "table_top");
  if (geom < 0) return true;
  const Eigen::Map<const Eigen::Vector3d> center(data->geom_xpos + 3 * geom),
      half(model->geom_size + 3 * geom);
  for (const auto& corner : corners(footprint)) {
    if (((corner - center.head<2>()).cwiseAbs() - half.head<2>()).maxCoeff() > 0) return false;
  }
  return true;
}

/// Draws all objects; false when two footprints come too close.
bool draw_objects(const Placement& placement, const RobotDescription& robot, TaskRandom& random,
                  const mjModel* model, mjData* data) {
  const double root_x = placement.root_x.draw(random), root_y = placement.root_y.draw(random);
  const double root_yaw = placement.root_yaw.draw(random);
  const Pose world_from_root =
      planar(placement.root.x() + root_x, placement.root.y() + root_y, placement.root.z(), root_yaw);
  const auto& [size_x, size_y] = robot.footprint_size;
  std::vector<Footprint> placed;
  if (size_x > 0 && size_y > 0) {
    placed.push_back({{robot.footprint_center[0], robot.footprint_center[1]}, 0, size_x / 2, size_y / 2});
  }
  for (const auto& object : placement.objects) {
    const double x = object.x.draw(random), y = object.y.draw(random), z = object.z.draw(random);
    const double yaw = object.yaw.draw(random);
    const Pose world_from_body = world_from_root * planar(x, y, z, yaw);
    set_pose(model, data, object.body, world_from_body);
    if (object.footprint_x == 0) continue;
    const Footprint footprint{world_from_body.position.head<2>(), root_yaw + yaw, object.footprint_x / 2,
                              object.footprint_y / 2};
    if (!on_table(model, data, footprint)) return false;
    for (const auto& other : placed) {
      if (footprint_distance(footprint, other) < placement.min_distance) return false;
    }
    placed.push_back(footprint);
  }
  return true;
}

/// A waypoint as far as it is known before the demonstration runs.
struct Waypoint {
  Pose world_from_frame, frame_from_tool;
  int yaw_symmetry = 1;
};

std::vector<Waypoint> waypoints(const Script& script, const mjModel* model, const mjData* data) {
  std::vector<Waypoint> result;
  for (const auto& step : script.steps) {
    const auto* move = std::get_if<MoveStep>(&step.what);
    if (!move || move->frame == "tool") continue;
    if (const auto world_from_frame = find_frame(model, data, move->frame)) {
      result.push_back({*world_from_frame, move->frame_from_tool, move->yaw_symmetry});
    }
  }
  return result;
}

bool within(const Waypoint& waypoint, const Box& bounds) {
  const Eigen::Vector3d position = waypoint.world_from_frame * waypoint.frame_from_tool.position;
  return bounds.contains(position - kTracking) && bounds.contains(position + kTracking);
}

/// In one of the rotations that the step calls as good.
bool reachable(const Waypoint& waypoint, const Kinematics& arm, const JointVector& home) {
  const int folds = waypoint.yaw_symmetry == 0 ? 4 : std::min(waypoint.yaw_symmetry, 8);
  for (int i = 0; i < folds; ++i) {
    const double yaw = 2 * std::numbers::pi * i / folds;
    const Pose world_from_tool = waypoint.world_from_frame * planar(0, 0, 0, yaw) * waypoint.frame_from_tool;
    if (!arm.solve_all(world_from_tool, home).empty()) return true;
  }
  return false;
}

/// Distance from a point to a footprint's area.
double distance_to(const Footprint& f, const Eigen::Vector2d& point) {
  const Eigen::Vector2d local = Eigen::Rotation2Dd(-f.yaw) * (point - f.center);
  return (local.cwiseAbs() - Eigen::Vector2d(f.half_x, f.half_y)).cwiseMax(0).norm();
}

/// An axis of one of both along which their shadows do not meet.
bool separated(const Footprint& a, const Footprint& b) {
  const auto corners_a = corners(a), corners_b = corners(b);
  for (const double angle : {a.yaw, a.yaw + std::numbers::pi / 2, b.yaw, b.yaw + std::numbers::pi / 2}) {
    const Eigen::Vector2d axis(std::cos(angle), std::sin(angle));
    double lower_a = 1e9, upper_a = -1e9, lower_b = 1e9, upper_b = -1e9;
    for (std::size_t i = 0; i < 4; ++i) {
      lower_a = std::min(lower_a, axis.dot(corners_a[i]));
      upper_a = std::max(upper_a, axis.dot(corners_a[i]));
      lower_b = std::min(lower_b, axis.dot(corners_b[i]));
      upper_b = std::max(upper_b, axis.dot(corners_b[i]));
    }
    if (upper_a < lower_b || upper_b < lower_a) return true;
  }
  return false;
}

}  // namespace

Box read_box(const TaskReader& reader, const TaskNode& node, const std::string& what) {
  reader.check_keys(node, what, {"min", "max"});
  const auto lower = reader.numbers(reader.require(node, "min"), "min", 3);
  const auto upper = reader.numbers(reader.require(node, "max"), "max", 3);
  Box box;
  for (int i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (lower[k] >= upper[k]) reader.fail(node, "'min' must be below 'max' on every axis");
    box.min[i] = lower[k];
    box.max[i] = upper[k];
  }
  return box;
}

Placement read_placement(const TaskReader& reader, const TaskNode& node, const mjModel* model) {
  reader.check_keys(node, "placement", {"root", "min_distance", "waypoints", "objects"});
  Placement placement;
  const TaskNode& root = reader.require(node, "root");
  reader.check_keys(root, "root", {"position", "x", "y", "yaw_deg"});
  const auto position = reader.numbers(reader.require(root, "position"), "position", 3);
  placement.root = {position[0], position[1], position[2]};
  placement.root_x = read_range(reader, root, "x", 1);
  placement.root_y = read_range(reader, root, "y", 1);
  placement.root_yaw = read_range(reader, root, "yaw_deg", kRadPerDeg);
  if (const auto* distance = node.find("min_distance")) {
    placement.min_distance = reader.number(*distance, "min_distance");
    if (placement.min_distance < 0) reader.fail(*distance, "'min_distance' must not be negative");
  }
  if (const auto* waypoints = node.find("waypoints"))
    placement.waypoints = read_box(reader, *waypoints, "waypoints");
  for (const auto& item : reader.list(reader.require(node, "objects"), "objects")) {
    placement.objects.push_back(read_object(reader, item, model));
  }
  return placement;
}

void place(const Placement& placement, const RobotDescription& robot, const Script& demonstration,
           const Box& bounds, const Kinematics& arm, TaskRandom& random, const mjModel* model, mjData* data) {
  const Box& box = placement.waypoints ? *placement.waypoints : bounds;
  mj_kinematics(model, data);
  for (int i = 0; i < kTries; ++i) {
    if (!draw_objects(placement, robot, random, model, data)) continue;
    mj_kinematics(model, data);
    const auto wanted = waypoints(demonstration, model, data);
    if (std::all_of(wanted.begin(), wanted.end(), [&](const auto& each) { return within(each, box); }) &&
        std::all_of(wanted.begin(), wanted.end(),
                    [&](const auto& each) { return reachable(each, arm, robot.home); })) {
      return;
    }
  }
  throw std::runtime_error(
      "no placement keeps the distances and has every waypoint in reach and within the bounds");
}

double footprint_distance(const Footprint& a, const Footprint& b) {
  if (!separated(a, b)) return 0;
  double distance = 1e9;
  for (const auto& corner : corners(a)) distance = std::min(distance, distance_to(b, corner));
  for (const auto& corner : corners(b)) distance = std::min(distance, distance_to(a, corner));
  return distance;
}

bool has_frame(const mjModel* model, const std::string& name) {
  return name == "world" || name == "tool" || mj_name2id(model, mjOBJ_SITE, name.c_str()) >= 0 ||
         mj_name2id(model, mjOBJ_BODY, name.c_str()) >= 0;
}

std::string unknown_frame_text(const mjModel* model, const std::string& name) {
  std::string known = "world, tool";
  for (const auto& [type, count] :
       {std::pair{mjOBJ_SITE, model->nsite}, std::pair{mjOBJ_BODY, model->nbody}}) {
    for (int i = 0; i < count; ++i) {
      const char* other = mj_id2name(model, type, i);
      const std::string word = other ? other : "";
      if (!word.empty() && word != "world" && word != "tool") known += ", " + word;
    }
  }
  return "the scene has no frame '" + name + "' (known: " + known + ")";
}

std::optional<Pose> find_frame(const mjModel* model, const mjData* data, const std::string& name) {
  if (name == "world") return Pose{};
  const mjtNum *position = nullptr, *matrix = nullptr;
  if (const int site = mj_name2id(model, mjOBJ_SITE, name.c_str()); site >= 0) {
    position = data->site_xpos + 3 * site;
    matrix = data->site_xmat + 9 * site;
  } else if (const int body = mj_name2id(model, mjOBJ_BODY, name.c_str()); body >= 0) {
    position = data->xpos + 3 * body;
    matrix = data->xmat + 9 * body;
  } else {
    return std::nullopt;
  }
  Eigen::Matrix3d rotation;
  rotation << matrix[0], matrix[1], matrix[2], matrix[3], matrix[4], matrix[5], matrix[6], matrix[7],
      matrix[8];
  return Pose{Eigen::Map<const Eigen::Vector3d>(position), Eigen::Quaterniond(rotation).normalized()};
}

}  // namespace flowscope
