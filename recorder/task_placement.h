// Where an episode's objects stand.
//
//   placement:
//     root: {position: [0.25, 0, 0.752], x: [-0.05, 0.05], y: 0, yaw_deg: [-180, 180]}
//     min_distance: 0.10
//     waypoints: {min: [0, -0.3, 0.76], max: [0.5, 0.3, 1]}
//     objects:
//       - {body: button_1, x: [-0.25, 0.25], y: [-0.3, 0.3], yaw_deg: [-180, 180], footprint: [0.1, 0.1]}
//
// Lengths in metres. The root's ranges are offsets; an object's position and yaw are in the root's frame. A
// range is a number or [lower, upper], 0 where it is left out. `min_distance` (optional) lies between
// footprints.
//
// A placement is drawn again until the footprints keep their distance and every waypoint of the demonstration
// lies within the box `waypoints` (optional; the task's keyframe bounds), with three millimetres to spare
// (one in height). A box narrower than the bounds is for keyframes that end farther from their waypoints: an
// object may shift a little when it is gripped.
#pragma once

#include <optional>
#include <vector>

#include "recorder/motion/kinematics.h"
#include "recorder/task_random.h"
#include "recorder/task_tree.h"
#include "render/observation.h"

struct mjModel_;
struct mjData_;

namespace flowscope {

struct Range {
  double lower = 0, upper = 0;
  double draw(TaskRandom& random) const { return lower == upper ? lower : random.uniform(lower, upper); }
};

struct PlacedObject {
  int body = 0;                             ///< a mocap body, or one with a free joint
  Range x, y, z, yaw;                       ///< metres and rad in the root's frame
  double footprint_x = 0, footprint_y = 0;  ///< metres, whole sides; 0: keeps no distance
};

struct Placement {
  Eigen::Vector3d root{0, 0, 0};  ///< metres, world
  Range root_x, root_y, root_yaw;
  double min_distance = 0;
  std::optional<Box> waypoints;  ///< metres, world
  std::vector<PlacedObject> objects;
};

/// `{min: [x, y, z], max: [x, y, z]}`. `what` names it in complaints.
Box read_box(const TaskReader& reader, const TaskNode& node, const std::string& what);

/// Throws BadScript for unknown bodies and bodies that can not be moved.
Placement read_placement(const TaskReader& reader, const TaskNode& node, const mjModel_* model);

/// Writes one accepted placement into `data` and brings its kinematics up to date. Throws std::runtime_error
/// when none is found in a bounded number of tries.
void place(const Placement& placement, const RobotDescription& robot, const Script& demonstration,
           const Box& bounds, const Kinematics& arm, TaskRandom& random, const mjModel_* model,
           mjData_* data);

/// Smallest distance between two upright boxes seen from above; 0 when they overlap.
struct Footprint {
  Eigen::Vector2d center{0, 0};
  double yaw = 0, half_x = 0, half_y = 0;
};
double footprint_distance(const Footprint& a, const Footprint& b);

/// World pose of a frame that a script may name: world, a site (tool among them) or a body. Kinematics must
/// be up to date. Empty for an unknown name.
std::optional<Pose> find_frame(const mjModel_* model, const mjData_* data, const std::string& name);
/// Whether there is one, which the model alone tells; `tool` always is.
bool has_frame(const mjModel_* model, const std::string& name);
/// For a message: that there is none, and which there are.
std::string unknown_frame_text(const mjModel_* model, const std::string& name);

}  // namespace flowscope
