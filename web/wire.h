// The only place where values become JSON and back, apart from the readers of files that have a JSON header.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "policy/flow_trace.h"
#include "policy/trainer.h"
#include "recorder/demo.h"
#include "recorder/demo_store.h"
#include "web/backend.h"

namespace flowscope::web::wire {

using Json = nlohmann::ordered_json;

Json to_json(const FlowTrace& trace, bool with_weights = false);
/// Inverse of to_json for a trace file, which is foreign input: refuses what no prediction can be. Throws
/// ApiError 400 whose `where` is the place, behind `place` when the trace lies inside of another document.
FlowTrace trace_from_json(const Json& json, const std::string& place = {});
Json to_json(const DemoInfo& info);
Json demo_detail(const Demo& demo);  ///< info, instructions, keyframes with poses; no pixels, no states
Json to_json(const TaskEntry& task);
Json to_json(const StateSnapshot& state);
Json to_json(const ViewSettings& view);
Json to_json(const JobStatus& job);
Json to_json(const TrainReport& report);
Json to_json(const TraceEntry& entry);
Json to_json(const Step& step);
Json to_json(const PlacedStep& placed);
Json to_json(const CameraModel& camera);
Json to_json(const PickAnswer& answer);
Json to_json(const NamedFrame& frame);
Json to_json(const TeleopStatus& status);
Json error_json(const std::string& code, const std::string& message, const std::string& where);

/// Parses bounded JSON: depth <= 32, size <= 256 KiB, no duplicate or unknown surprises. Throws ApiError 400
/// with the place.
Json parse_body(const std::string& text);

/// Dumps with invalid UTF-8 replaced, never throwing.
std::string dump(const Json& json, int indent = -1);

}  // namespace flowscope::web::wire
