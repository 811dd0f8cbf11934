// What the page and the program say to each other about moving by hand and about waypoints.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "recorder/pick.h"
#include "recorder/script_poses.h"

namespace flowscope::web {

/// A place in a view's picture: fractions of its width and height, (0, 0) the upper left corner.
struct PickRequest {
  std::string view = "main";
  double u = 0, v = 0;
};
struct PickAnswer {
  Picked picked;
  std::vector<WaypointProposal> proposals;
};

struct WaypointsRequest {
  std::string script;           ///< YAML; empty: nothing is drawn any more
  std::optional<int> selected;  ///< index of the step that is drawn with its gripper
};

/// Speeds of the tool. They hold for 0.3 s: a hand that stays on its key repeats them.
struct JogRequest {
  Eigen::Vector3d linear_m_s = Eigen::Vector3d::Zero(), angular_rad_s = Eigen::Vector3d::Zero();
  bool in_tool_frame = false, may_touch = false;
};

struct TeleopStatus {
  Pose world_from_tool;
  double openness = 1;
  std::string jog = "still";  ///< still, moving, blocked, unreachable
  std::string message;        ///< why it is blocked or unreachable
  int frames = 0;             ///< since the reset
  int strokes = 0;            ///< movements by hand that can be undone
  int marks = 0;              ///< keyframes marked by hand
  bool by_hand = false;       ///< something was moved by hand since the reset
  bool success = false;
};

}  // namespace flowscope::web
