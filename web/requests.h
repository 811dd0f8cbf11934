// Request bodies as the typed values of Backend. Unknown keys and wrong types throw ApiError 400 with the
// key.
#pragma once

#include <optional>
#include <string>

#include "web/wire.h"

namespace flowscope::web::wire {

struct ResetRequest {
  std::string task;
  std::optional<int> variation;
  std::optional<std::uint64_t> seed;
};

ResetRequest reset_request(const Json& body);
/// What the body names is changed in `settings`; an orbit given without a camera switches to the orbit.
ViewSettings view_request(const Json& body, ViewSettings settings);
CameraDrag drag_request(const Json& body);
ScriptRequest script_request(const Json& body);
TrainRequest train_request(const Json& body);
PredictRequest predict_request(const Json& body);
/// Empty: nothing is shown any more.
std::optional<int> show_request(const Json& body);
BranchRequest branch_request(const Json& body);
ExportRequest export_request(const Json& body);
PickRequest pick_request(const Json& body, const std::string& view);
WaypointsRequest waypoints_request(const Json& body);
JogRequest jog_request(const Json& body);
double gripper_request(const Json& body);  ///< openness
bool save_request(const Json& body);       ///< also unfinished
void check_empty(const Json& body);        ///< of a call that takes no options

}  // namespace flowscope::web::wire
