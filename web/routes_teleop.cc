// Addresses of waypoints and of moving by hand.
#include <nlohmann/json.hpp>

#include "web/requests.h"
#include "web/routes.h"

namespace flowscope::web {

using wire::Json;

namespace {

constexpr const char* pick_schema = R"({"type":"object","required":["u","v"],"properties":{
  "u":{"type":"number","minimum":0,"maximum":1,"description":"fraction of the picture's width"},
  "v":{"type":"number","minimum":0,"maximum":1,"description":"fraction of its height, from the top"}}})";

constexpr const char* waypoints_schema = R"({"type":"object","required":["script"],"properties":{
  "script":{"type":"string","description":"empty: nothing is drawn any more"},
  "selected":{"type":["integer","null"],"minimum":0,"description":"the step that is drawn with its gripper"}}})";

constexpr const char* jog_schema = R"({"type":"object","properties":{
  "linear":{"$ref":"#/components/schemas/Vector3","description":"m/s"},
  "angular":{"$ref":"#/components/schemas/Vector3","description":"rad/s, about axes through the tool point"},
  "frame":{"enum":["world","tool"],"default":"world"},
  "may_touch":{"type":"boolean","default":false,"description":"push on what is in the way"}},
  "description":"Holds for 0.3 s; repeat it while the hand stays on its key, send zeros when it leaves."})";

template <typename Values>
Json list(const Values& values) {
  Json items = Json::array();
  for (const auto& value : values) items.push_back(wire::to_json(value));
  return items;
}

}  // namespace

void add_teleop_routes(std::vector<Route>& routes, Backend& backend) {
  routes.push_back({"GET", "/api/v1/views/{id}/camera", "The camera that a view is drawn with now",
                    Lane::scene, "", "Camera", [&backend](const Request& request) {
                      return json_response(wire::to_json(backend.view_camera(request.param("id"))));
                    }});
  routes.push_back({"POST", "/api/v1/views/{id}/pick",
                    "What lies at a place of the picture, and waypoints there", Lane::scene, pick_schema,
                    "Picked", [&backend](const Request& request) {
                      const auto pick = wire::pick_request(body_json(request), request.param("id"));
                      return json_response(wire::to_json(backend.pick(pick)));
                    }});
  routes.push_back({"GET", "/api/v1/frames", "The frames that a script may name", Lane::scene, "", "Frames",
                    [&backend](const Request&) {
                      return json_response({{"frames", list(backend.frames())}});
                    }});
  routes.push_back({"PUT", "/api/v1/waypoints", "Draws a script's waypoints and tells where they lie",
                    Lane::work, waypoints_schema, "Steps", [&backend](const Request& request) {
                      const auto wanted = wire::waypoints_request(body_json(request));
                      return json_response({{"steps", list(backend.set_waypoints(wanted))}});
                    }});
  routes.push_back({"GET", "/api/v1/teleop", "The tool, and what was moved by hand since the reset",
                    Lane::quick, "", "Teleop",
                    [&backend](const Request&) { return json_response(wire::to_json(backend.teleop())); }});
  routes.push_back({"POST", "/api/v1/teleop/jog", "Moves the tool by hand", Lane::quick, jog_schema, "Teleop",
                    [&backend](const Request& request) {
                      const auto jog = wire::jog_request(body_json(request));
                      return json_response(wire::to_json(backend.jog(jog)));
                    }});
  routes.push_back(
      {"POST", "/api/v1/teleop/gripper", "Moves the fingers; closing grasps, opening releases", Lane::scene,
       R"({"type":"object","required":["openness"],"properties":{"openness":{"type":"number","minimum":0,"maximum":1}}})",
       "Teleop", [&backend](const Request& request) {
         return json_response(wire::to_json(backend.jog_gripper(wire::gripper_request(body_json(request)))));
       }});
  routes.push_back({"POST", "/api/v1/teleop/undo", "Takes the last movement by hand back", Lane::scene,
                    R"({"type":"object","properties":{}})", "Teleop", [&backend](const Request& request) {
                      wire::check_empty(body_json(request));
                      return json_response(wire::to_json(backend.undo_jog()));
                    }});
  routes.push_back({"POST", "/api/v1/teleop/mark", "Marks a keyframe; the tool's pose as steps of a script",
                    Lane::scene, R"({"type":"object","properties":{}})", "Steps",
                    [&backend](const Request& request) {
                      wire::check_empty(body_json(request));
                      return json_response({{"steps", list(backend.mark_keyframe())}});
                    }});
  routes.push_back({"POST", "/api/v1/teleop/save", "Saves what was moved by hand since the reset",
                    Lane::scene,
                    R"({"type":"object","properties":{"unfinished":{"type":"boolean","default":false,
                      "description":"also when the task is not done"}}})",
                    "Saved", [&backend](const Request& request) {
                      const bool unfinished = wire::save_request(body_json(request));
                      return json_response({{"demo", backend.save_teleop(unfinished)}});
                    }});
}

}  // namespace flowscope::web
