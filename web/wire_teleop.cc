// Waypoints, picked points and teleoperation as JSON.
#include <nlohmann/json.hpp>
#include <numbers>

#include "web/wire.h"
#include "web/wire_values.h"

namespace flowscope::web::wire {

namespace {

Json move_json(const MoveStep& move) {
  return {{"kind", "move"},
          {"frame", move.frame},
          {"position", vector(move.frame_from_tool.position)},
          {"quaternion", vector(move.frame_from_tool.wxyz())},
          {"path", move.linear ? "linear" : "planned"},
          {"ignore_collisions", move.ignore_collisions},
          {"yaw_symmetry", move.yaw_symmetry}};
}

}  // namespace

Json to_json(const Step& step) {
  if (const auto* gripper = std::get_if<GripperStep>(&step.what))
    return {{"kind", "gripper"}, {"openness", gripper->openness}};
  return move_json(std::get<MoveStep>(step.what));
}

Json to_json(const PlacedStep& placed) {
  Json json = to_json(placed.step);
  json["line"] = placed.step.line;
  if (placed.move) {
    json["world"] = pose(placed.move->world_from_tool);
    json["base"] = pose(placed.move->world_from_base);
  }
  if (!placed.problem.empty()) json["problem"] = placed.problem;
  return json;
}

Json to_json(const CameraModel& camera) {
  return {{"name", camera.name},     {"width", camera.width},
          {"height", camera.height}, {"fx", camera.fx},
          {"fy", camera.fy},         {"cx", camera.cx},
          {"cy", camera.cy},         {"world_from_camera", pose(camera.world_from_camera)}};
}

Json to_json(const PickAnswer& answer) {
  Json proposals = Json::array();
  for (const auto& proposal : answer.proposals) {
    proposals.push_back({{"approach", proposal.approach},
                         {"step", move_json(proposal.move)},
                         {"world", pose(proposal.world_from_tool)}});
  }
  return {{"point", vector(answer.picked.point)}, {"normal", vector(answer.picked.normal)},
          {"body", answer.picked.body},           {"geom", answer.picked.geom},
          {"depth_m", answer.picked.depth_m},     {"proposals", std::move(proposals)}};
}

Json to_json(const NamedFrame& frame) {
  Json json = pose(frame.world_from_frame);
  json["name"] = frame.name;
  return json;
}

Json to_json(const TeleopStatus& status) {
  Json json = pose(status.world_from_tool);
  json["openness"] = status.openness;
  json["jog"] = status.jog;
  json["message"] = status.message;
  json["frames"] = status.frames;
  json["strokes"] = status.strokes;
  json["marks"] = status.marks;
  json["by_hand"] = status.by_hand;
  json["success"] = status.success;
  return json;
}

}  // namespace flowscope::web::wire
