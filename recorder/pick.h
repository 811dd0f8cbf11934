// From a place in a picture to waypoints there.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "recorder/script.h"
#include "render/camera_model.h"

namespace flowscope {

class World;

/// What a ray through a pixel meets first. Rays meet the shapes that pictures show, exactly as they are;
/// nothing is drawn for it.
struct Picked {
  Eigen::Vector3d point, normal;  ///< metres, world; the normal has length 1 and looks at the camera
  std::string body, geom;         ///< names; empty where the scene gives none
  int geom_id = -1;
  double depth_m = 0;  ///< along the camera's z
};
/// `u`, `v`: pixels, centres at integer + 0.5. Empty: nothing there.
std::optional<Picked> pick(const World& world, const CameraModel& camera, double u, double v);

/// A way to bring the tool to what was picked, as a step of a script.
struct WaypointProposal {
  std::string approach;  ///< above, normal, middle
  MoveStep move;
  Pose world_from_tool;
};
/// From above and along the surface's normal to the point itself, and from above to the middle of the part's
/// top. The tool turns as little as it can from `present`, but along the edges of a box. Steps are given in
/// the frame of the body that was picked, so that they follow it to other placements; `world` for what no
/// placement moves.
std::vector<WaypointProposal> propose_waypoints(const World& world, const Picked& picked,
                                                const Pose& present);

/// The tool's present pose as a step, in the frame of what the tool points at within 15 cm; else `world`.
MoveStep step_at_tool(const World& world);

/// `world_from_tool` in a frame of the scene; throws std::invalid_argument for an unknown one.
MoveStep step_in_frame(const World& world, const std::string& frame, const Pose& world_from_tool);

struct NamedFrame {
  std::string name;
  Pose world_from_frame;
};
/// All frames that a script may name, `world` and `tool` first.
std::vector<NamedFrame> scene_frames(const World& world);

}  // namespace flowscope
