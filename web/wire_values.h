// The small values that several JSON documents share.
#pragma once

#include <nlohmann/json.hpp>

#include "web/wire.h"

namespace flowscope::web::wire {

inline constexpr const char* trace_format = "flowscope-trace/1";

template <typename Vector>
Json vector(const Vector& v) {
  Json json = Json::array();
  for (Eigen::Index i = 0; i < v.size(); ++i) json.push_back(v[i]);
  return json;
}

inline Json pose(const Pose& pose) {
  return {{"position", vector(pose.position)}, {"quaternion", vector(pose.wxyz())}};
}

inline Json action(const GripperAction& action) {
  Json json = pose(action.world_from_tool);
  json["open"] = action.open();
  json["openness"] = action.openness;
  return json;
}

inline Json pose_error(const PoseError& error) {
  return {{"position_m", error.position_m},
          {"rotation_deg", error.rotation_deg},
          {"open_correct", error.open_correct}};
}

}  // namespace flowscope::web::wire
