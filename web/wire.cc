#include "web/wire.h"

#include <nlohmann/json.hpp>

#include "web/wire_terms.h"
#include "web/wire_values.h"

namespace flowscope::web::wire {

Json to_json(const DemoInfo& info) {
  const DemoOrigin& origin = info.origin;
  return {{"id", info.id},
          {"task", info.task},
          {"variation", info.variation},
          {"seed", info.seed},
          {"instruction", info.instruction},
          {"frames", info.frames},
          {"keyframes", info.keyframes},
          {"created", info.created},
          {"bytes", info.bytes},
          {"robot", origin.robot.empty() ? Json() : Json(origin.robot)},
          {"scene", origin.scene ? Json(origin.scene->scene) : Json()},
          {"success", info.success ? Json(*info.success) : Json()}};
}

namespace {

Json scene_json(const SceneOrigin& scene) {
  Json json{{"file", scene.scene},
            {"robot", scene.robot},
            {"folder", scene.folder},
            {"sha256", scene.scene_sha256},
            {"robot_sha256", scene.robot_sha256}};
  if (!scene.key.empty()) json["key"] = scene.key;
  return json;
}

}  // namespace

Json demo_detail(const Demo& demo) {
  Json json = to_json(demo.info);
  if (demo.info.origin.scene) json["scene_origin"] = scene_json(*demo.info.origin.scene);
  json["instructions"] = demo.instructions;
  json["bounds"] = {{"min", vector(demo.bounds.min)}, {"max", vector(demo.bounds.max)}};
  json["seconds"] = demo.frames.empty() ? 0.0 : demo.frames.back().time_s - demo.frames.front().time_s;
  Json cameras = Json::array();
  for (const View& view : demo.start.views) cameras.push_back(view.camera.name);
  json["cameras"] = cameras;
  Json keyframes = Json::array();
  for (const Keyframe& keyframe : demo.keyframes) {
    Json item{{"frame", keyframe.frame}, {"action", action(keyframe.action)}};
    const auto index = static_cast<std::size_t>(keyframe.frame);
    if (keyframe.frame >= 0 && index < demo.frames.size()) item["time_s"] = demo.frames[index].time_s;
    keyframes.push_back(std::move(item));
  }
  json["keyframes"] = std::move(keyframes);  // here the list, with poses, takes the place of the count
  return json;
}

Json to_json(const TaskEntry& task) {
  return {{"name", task.name}, {"variations", task.variations}, {"instructions", task.instructions}};
}

Json to_json(const ViewSettings& view) {
  const OrbitCamera& orbit = view.orbit;
  return {{"id", view.id},
          {"camera", view.camera ? Json(*view.camera) : Json()},
          {"orbit",
           {{"azimuth_deg", orbit.azimuth_deg},
            {"elevation_deg", orbit.elevation_deg},
            {"distance", orbit.distance_m},
            {"distance_m", orbit.distance_m},
            {"lookat", vector(orbit.lookat)},
            {"fovy_deg", orbit.fovy_deg}}},
          {"width", view.width},
          {"height", view.height},
          {"overlays", view.overlays},
          {"detectors", view.detectors}};
}

namespace {

/// Null where nothing was held out to measure it on.
template <typename Errors>
Json if_measured(const Errors& errors, double value) {
  return errors.keyframes > 0 ? Json(value) : Json();
}

Json status_json(const TrainStatus& status) {
  Json tasks = Json::array();
  for (const TaskError& t : status.validation.tasks)
    tasks.push_back({{"task", t.task},
                     {"position_mm", if_measured(t, t.position_mm)},
                     {"rotation_deg", if_measured(t, t.rotation_deg)},
                     {"keyframes", t.keyframes}});
  return {{"step", status.step},
          {"loss", status.loss},
          {"loss_flow", status.loss_flow},
          {"loss_position", status.loss_position},
          {"loss_rotation", status.loss_rotation},
          {"loss_open", status.loss_open},
          {"skipped", status.skipped},
          {"samples_per_s", status.samples_per_s},
          {"minutes", status.minutes},
          {"demos", status.demos},
          {"validation",
           {{"position_mm", if_measured(status.validation, status.validation.position_mm)},
            {"rotation_deg", if_measured(status.validation, status.validation.rotation_deg)},
            {"keyframes", status.validation.keyframes},
            {"tasks", tasks}}}};
}

}  // namespace

Json to_json(const StateSnapshot& state) {
  Json views = Json::array(), terms = Json::array();
  for (const ViewSettings& view : state.views) views.push_back(to_json(view));
  for (const SuccessTerm& term : state.terms) terms.push_back(to_json(term));
  return {{"task", state.task},
          {"variation", state.variation},
          {"seed", state.seed},
          {"instruction", state.instruction},
          {"views", std::move(views)},
          {"cameras", state.cameras},
          {"episode", state.episode},
          {"time_s", state.time_s},
          {"success", state.success},
          {"terms", std::move(terms)},
          {"recording", {{"running", state.recording.running}, {"job", state.recording.job}}},
          {"training", state.training},
          {"train", status_json(state.train)},
          {"policy",
           {{"loaded", state.policy.loaded},
            {"file", state.policy.file},
            {"generation", state.policy.generation}}},
          {"viewers", state.viewers},
          {"rendering_error", state.rendering_error.empty() ? Json() : Json(state.rendering_error)},
          {"shown", state.shown ? Json{{"trace", state.shown->trace}, {"step", state.shown->step}} : Json()},
          {"teleop", to_json(state.teleop)}};
}

Json to_json(const JobStatus& job) {
  Json json{{"id", job.id},
            {"kind", job.kind},
            {"state", job.state},
            {"progress", job.progress},
            {"message", job.message}};
  Json result = Json::object();
  if (!job.demo.empty()) result["demo"] = job.demo;
  if (!job.url.empty()) result["url"] = job.url;
  if (!job.path.empty()) result["path"] = job.path;
  if (job.state == "done") result["success"] = job.success;
  if (!result.empty()) json["result"] = std::move(result);
  if (job.state == "failed") json["error"] = error_json(job.error_code, job.error, job.where)["error"];
  return json;
}

Json to_json(const TrainReport& report) {
  Json json{{"running", report.running}};
  json.update(status_json(report.status));
  json["loss_history"] = report.loss_history;
  json["validation_history"] = report.validation_history;
  json["error"] = report.error.empty() ? Json() : Json(report.error);
  Json left_out = Json::array();
  for (const auto& [id, problem] : report.left_out) left_out.push_back({{"id", id}, {"problem", problem}});
  json["left_out"] = std::move(left_out);
  return json;
}

Json to_json(const TraceEntry& entry) {
  return {{"id", entry.id},
          {"created", entry.created},
          {"task", entry.task},
          {"instruction", entry.instruction},
          {"flow_steps", entry.flow_steps},
          {"error", entry.error ? pose_error(*entry.error) : Json()},
          {"parent", entry.parent ? Json(*entry.parent) : Json()}};
}

Json error_json(const std::string& code, const std::string& message, const std::string& where) {
  Json error{{"code", code}, {"message", message}};
  if (!where.empty()) error["where"] = where;
  return {{"error", std::move(error)}};
}

std::string dump(const Json& json, int indent) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

}  // namespace flowscope::web::wire
