#include <nlohmann/json.hpp>

#include "web/requests.h"
#include "web/routes.h"

namespace flowscope::web {

using wire::Json;

namespace {

constexpr const char* train_schema = R"({"type":"object","required":["action"],"properties":{
  "action":{"enum":["start","stop"]},"resume":{"type":"boolean"},"steps":{"type":"integer","minimum":1},"minutes":{"type":"number"},
  "tasks":{"type":"array","items":{"type":"string"}},"unfinished":{"type":"boolean"},"preset":{"enum":["nano","desk","paper"]},
  "objective":{"enum":["cfm","ddim","ddpm"]},"backbone":{"enum":["mamba","transformer"]},
  "radius":{"enum":["linear","cosine","off"]},"point_encoder":{"type":["boolean","string"]},
  "grounded":{"type":"boolean"},"augment":{"type":"boolean"},"seed":{"type":"integer","minimum":0}}})";

constexpr const char* predict_schema = R"({"type":"object",
  "description":"flow_steps x samples x stages of the integrator (euler 1, midpoint 2, rk4 4) may be at most 4000. From 100 steps of all samples together a prediction is long: two long ones at a time, 429 beyond; short ones pass them.",
  "properties":{
  "flow_steps":{"type":"integer","minimum":1,"maximum":1000,"default":4},
  "seed":{"type":"integer","minimum":0},"samples":{"type":"integer","minimum":1,"maximum":64,"default":1},
  "integrator":{"enum":["euler","midpoint","rk4"],"default":"euler","description":"diffusion takes its own steps only"},
  "objective":{"enum":["cfm","ddim","ddpm"]},"radius":{"enum":["linear","cosine","off"]}}})";

constexpr const char* branch_schema = R"({"type":"object","required":["step"],"properties":{
  "step":{"type":"integer","minimum":0},"position":{"$ref":"#/components/schemas/Vector3"},
  "quaternion":{"$ref":"#/components/schemas/Quaternion"},"radius":{"type":"number","description":"metres"},
  "flow_steps":{"type":"integer","minimum":1,"maximum":1000}}})";

}  // namespace

void add_policy_routes(std::vector<Route>& routes, Backend& backend) {
  routes.push_back(
      {"GET", "/api/v1/train", "How training goes", Lane::quick, "", "Train",
       [&backend](const Request&) { return json_response(wire::to_json(backend.train_report())); }});
  routes.push_back({"POST", "/api/v1/train", "Starts or stops training", Lane::slow, train_schema, "Train",
                    [&backend](const Request& request) {
                      return json_response(
                          wire::to_json(backend.train(wire::train_request(body_json(request)))));
                    }});
  routes.push_back(
      {"POST", "/api/v1/predict", "Predicts the next keyframe from the current scene", Lane::slow,
       predict_schema, "Predicted", [&backend](const Request& request) {
         return json_response({{"traces", backend.predict(wire::predict_request(body_json(request)))}});
       }});
  routes.push_back(
      {"GET", "/api/v1/traces", "All flow traces", Lane::work, "", "Traces", [&backend](const Request&) {
         Json list = Json::array();
         for (const TraceEntry& entry : backend.traces()) list.push_back(wire::to_json(entry));
         return json_response({{"traces", std::move(list)}});
       }});
  routes.push_back({"GET",
                    "/api/v1/traces/{id}",
                    "A flow trace; weights=1 adds what each end point rests on",
                    Lane::work,
                    "",
                    "Trace",
                    [&backend](const Request& request) {
                      const bool weights = request.query.integer("weights", 0, 0, 1) == 1;
                      return json_response(wire::to_json(backend.trace(request.param("id")), weights));
                    },
                    {{"weights", R"({"enum":[0,1],"default":0})"}}});
  routes.push_back({"DELETE", "/api/v1/traces/{id}", "Removes a flow trace", Lane::work, "", "",
                    [&backend](const Request& request) {
                      backend.remove_trace(request.param("id"));
                      return no_content();
                    }});
  routes.back().success = 204;
  routes.push_back(
      {"POST", "/api/v1/traces/{id}/show", "Draws a step over every view; null clears it", Lane::work,
       R"({"type":"object","required":["step"],"properties":{"step":{"type":["integer","null"]}}})", "",
       [&backend](const Request& request) {
         backend.show_trace(request.param("id"), wire::show_request(body_json(request)));
         return no_content();
       }});
  routes.back().success = 204;
  routes.push_back({"POST", "/api/v1/traces/{id}/branch", "Runs on from an edited step", Lane::slow,
                    branch_schema, "Branched", [&backend](const Request& request) {
                      const BranchRequest branch = wire::branch_request(body_json(request));
                      return json_response({{"trace", backend.branch_trace(request.param("id"), branch)}});
                    }});
  routes.push_back({"POST", "/api/v1/traces/{id}/execute", "Plans to the predicted keyframe and moves there",
                    Lane::quick, R"({"type":"object","properties":{}})", "Started",
                    [&backend](const Request& request) {
                      wire::check_empty(body_json(request));
                      return json_response({{"job", backend.execute_trace(request.param("id"))}}, 202);
                    }});
  routes.back().success = 202;
}

}  // namespace flowscope::web
