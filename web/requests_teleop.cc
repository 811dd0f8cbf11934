// Request bodies of teleoperation and waypoints.
#include <nlohmann/json.hpp>

#include "web/fields.h"
#include "web/requests.h"

namespace flowscope::web::wire {

namespace {
constexpr double fastest_m_s = 10, fastest_rad_s = 50;  ///< beyond what any arm does: nonsense
constexpr int most_steps = 10'000;
}  // namespace

PickRequest pick_request(const Json& body, const std::string& view) {
  Fields fields(body);
  PickRequest request;
  request.view = view;
  for (const auto& [key, value] : {std::pair{"u", &request.u}, {"v", &request.v}}) {
    *value = fields.number(key);
    if (*value < 0 || *value > 1) fields.fail(key, "must lie in [0, 1], a fraction of the picture");
  }
  fields.finish();
  return request;
}

WaypointsRequest waypoints_request(const Json& body) {
  Fields fields(body);
  WaypointsRequest request;
  request.script = fields.text("script", 256 * 1024);
  if (fields.has("selected")) request.selected = static_cast<int>(fields.integer("selected", 0, most_steps));
  fields.finish();
  return request;
}

JogRequest jog_request(const Json& body) {
  Fields fields(body);
  JogRequest request;
  if (fields.has("linear")) request.linear_m_s = fields.vector3("linear");
  if (fields.has("angular")) request.angular_rad_s = fields.vector3("angular");
  if (fields.has("frame")) request.in_tool_frame = fields.one_of("frame", {"world", "tool"}) == "tool";
  if (fields.has("may_touch")) request.may_touch = fields.boolean("may_touch");
  if (request.linear_m_s.cwiseAbs().maxCoeff() > fastest_m_s) fields.fail("linear", "is above 10 m/s");
  if (request.angular_rad_s.cwiseAbs().maxCoeff() > fastest_rad_s)
    fields.fail("angular", "is above 50 rad/s");
  fields.finish();
  return request;
}

double gripper_request(const Json& body) {
  Fields fields(body);
  const double openness = fields.number("openness");
  if (openness < 0 || openness > 1) fields.fail("openness", "must lie in [0, 1]");
  fields.finish();
  return openness;
}

bool save_request(const Json& body) {
  Fields fields(body);
  const bool unfinished = fields.has("unfinished") && fields.boolean("unfinished");
  fields.finish();
  return unfinished;
}

void check_empty(const Json& body) { Fields(body).finish(); }

}  // namespace flowscope::web::wire
