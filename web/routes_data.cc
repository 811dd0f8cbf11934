#include <nlohmann/json.hpp>

#include "web/requests.h"
#include "web/routes.h"

namespace flowscope::web {

using wire::Json;

void add_data_routes(std::vector<Route>& routes, Backend& backend) {
  routes.push_back(
      {"GET", "/api/v1/demos", "All demonstrations", Lane::work, "", "Demos", [&backend](const Request&) {
         Json list = Json::array();
         for (const DemoInfo& info : backend.demos()) list.push_back(wire::to_json(info));
         return json_response({{"demos", std::move(list)}});
       }});
  routes.push_back({"GET", "/api/v1/demos/{id}", "A demonstration: instructions and keyframes", Lane::work,
                    "", "DemoDetail", [&backend](const Request& request) {
                      return json_response(wire::demo_detail(backend.demo(request.param("id"))));
                    }});
  routes.push_back({"DELETE", "/api/v1/demos/{id}", "Moves a demonstration to the bin", Lane::work, "", "",
                    [&backend](const Request& request) {
                      backend.remove_demo(request.param("id"));
                      return no_content();
                    }});
  routes.back().success = 204;
  routes.push_back({"GET",
                    "/api/v1/demos/{id}/picture",
                    "What a camera saw at a keyframe (-1: at the start)",
                    Lane::work,
                    "",
                    "image/png",
                    [&backend](const Request& request) {
                      const int keyframe = request.query.integer("keyframe", -1, -1, 100000);
                      const std::string camera = request.query.get("camera").value_or("front");
                      Response response = picture_response(
                          backend.demo_picture(request.param("id"), keyframe, camera), "image/png");
                      response.headers.emplace_back("Cache-Control", "private, max-age=3600");
                      return response;
                    },
                    {{"keyframe", R"({"type":"integer","minimum":-1,"default":-1})"},
                     {"camera", R"({"type":"string","default":"front"})"}}});
  routes.push_back({"POST", "/api/v1/export",
                    "Writes a figure, film or cloud: two at a time, 16 wait, 429 beyond", Lane::work,
                    R"({"type":"object","required":["kind"],"properties":{
                      "kind":{"enum":["png","mp4","strip","cloud","gltf","report"]},"trace":{"type":"string"},
                      "demo":{"type":"string"},"step":{"type":"integer","minimum":0},"camera":{"type":"string"},
                      "width":{"type":"integer"},"height":{"type":"integer"},
                      "detectors":{"type":"boolean","default":false}}})",
                    "Started", [&backend](const Request& request) {
                      const Json body = body_json(request);
                      return json_response({{"job", backend.export_media(wire::export_request(body))}}, 202);
                    }});
  routes.back().success = 202;
  routes.push_back({"GET", "/exports/{file}", "A finished export; Range is understood", Lane::quick, "",
                    "application/octet-stream", [&backend](const Request& request) {
                      return file_response(backend.export_file(request.param("file")), request.range);
                    }});
}

}  // namespace flowscope::web
