#include <nlohmann/json.hpp>

#include "web/requests.h"
#include "web/routes.h"

namespace flowscope::web {

using wire::Json;

namespace {

constexpr const char* view_schema = R"({"type":"object","properties":{
  "camera":{"type":["string","null","object"],"description":"a camera's name, or an orbit"},
  "orbit":{"$ref":"#/components/schemas/Orbit"},
  "azimuth_deg":{"type":"number"},"elevation_deg":{"type":"number"},"distance":{"type":"number"},
  "lookat":{"$ref":"#/components/schemas/Vector3"},"fovy_deg":{"type":"number"},
  "size":{"type":"array","items":{"type":"integer"},"minItems":2,"maxItems":2},
  "width":{"type":"integer"},"height":{"type":"integer"},"overlays":{"type":"boolean"},
  "detectors":{"type":"boolean","description":"draw the volumes that success terms watch"}}})";

}  // namespace

void add_scene_routes(std::vector<Route>& routes, Backend& backend) {
  routes.push_back({"GET", "/api/v1/state", "The present scene, recording, training and policy", Lane::quick,
                    "", "State",
                    [&backend](const Request&) { return json_response(wire::to_json(backend.state())); }});
  routes.push_back({"GET", "/api/v1/tasks", "All tasks", Lane::work, "", "Tasks", [&backend](const Request&) {
                      Json list = Json::array();
                      for (const TaskEntry& task : backend.tasks()) list.push_back(wire::to_json(task));
                      return json_response({{"tasks", std::move(list)}});
                    }});
  routes.push_back({"GET", "/api/v1/tasks/{name}/script", "The task's own demonstration", Lane::work, "",
                    "text/yaml", [&backend](const Request& request) {
                      Response response;
                      response.content_type = "text/yaml; charset=utf-8";
                      response.body = backend.task_script(request.param("name"));
                      return response;
                    }});
  routes.push_back({"POST", "/api/v1/reset", "Starts an episode", Lane::scene,
                    R"({"type":"object","required":["task"],"properties":{"task":{"type":"string"},
                      "variation":{"type":"integer","minimum":0},"seed":{"type":"integer","minimum":0}}})",
                    "State", [&backend](const Request& request) {
                      const auto reset = wire::reset_request(body_json(request));
                      return json_response(
                          wire::to_json(backend.reset(reset.task, reset.variation, reset.seed)));
                    }});
  routes.push_back({"GET", "/api/v1/views/{id}", "A view's camera, size and overlays", Lane::quick, "",
                    "View", [&backend](const Request& request) {
                      return json_response(wire::to_json(backend.view(request.param("id"))));
                    }});
  routes.push_back({"PUT", "/api/v1/views/{id}", "Changes what the body names", Lane::quick, view_schema,
                    "View", [&backend](const Request& request) {
                      const Json body = body_json(request);
                      const ViewSettings wanted = wire::view_request(body, backend.view(request.param("id")));
                      return json_response(wire::to_json(backend.set_view(wanted)));
                    }});
  routes.push_back({"POST", "/api/v1/views/{id}/drag", "A mouse drag; fractions of the picture's height",
                    Lane::quick,
                    R"({"type":"object","required":["action"],"properties":{
                      "action":{"enum":["rotate","pan","zoom"]},"dx":{"type":"number"},"dy":{"type":"number"}}})",
                    "View", [&backend](const Request& request) {
                      const CameraDrag drag = wire::drag_request(body_json(request));
                      return json_response(wire::to_json(backend.drag_view(request.param("id"), drag)));
                    }});
  routes.push_back({"POST", "/api/v1/script", "Runs a waypoint script, or a task's own demonstration",
                    Lane::work,
                    R"({"type":"object","properties":{"script":{"type":"string"},"task":{"type":"string"},
                      "record":{"type":"boolean","default":false}}})",
                    "Started", [&backend](const Request& request) {
                      const std::string job = backend.run_script(wire::script_request(body_json(request)));
                      return json_response({{"job", job}}, 202);
                    }});
  routes.back().success = 202;
  routes.push_back({"GET", "/api/v1/jobs", "Jobs: those that wait or run, and the newest 100 that ended",
                    Lane::quick, "", "Jobs", [&backend](const Request&) {
                      Json list = Json::array();
                      for (const JobStatus& job : backend.jobs()) list.push_back(wire::to_json(job));
                      return json_response({{"jobs", std::move(list)}});
                    }});
  routes.push_back({"GET", "/api/v1/jobs/{id}", "How far a job is", Lane::quick, "", "Job",
                    [&backend](const Request& request) {
                      return json_response(wire::to_json(backend.job(request.param("id"))));
                    }});
  routes.push_back({"DELETE", "/api/v1/jobs/{id}", "Cancels a job; one that waits at once", Lane::quick, "",
                    "Job", [&backend](const Request& request) {
                      backend.cancel_job(request.param("id"));
                      return json_response(wire::to_json(backend.job(request.param("id"))));
                    }});
}

}  // namespace flowscope::web
