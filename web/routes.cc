#include "web/routes.h"

#include <nlohmann/json.hpp>

namespace flowscope::web {

using wire::Json;

std::vector<Route> make_routes(Backend& backend, RouteSources sources) {
  std::vector<Route> routes;
  add_server_routes(routes, backend, std::move(sources));
  add_scene_routes(routes, backend);
  add_teleop_routes(routes, backend);
  add_policy_routes(routes, backend);
  add_data_routes(routes, backend);
  return routes;
}

void add_server_routes(std::vector<Route>& routes, Backend& backend, RouteSources sources) {
  const QueryField view{"view", R"({"type":"string","default":"main"})"};
  routes.push_back(
      {"GET",
       "/",
       "The page",
       Lane::page,
       "",
       "text/html",
       {},
       {{"token", R"({"type":"string"})"},
        {"action", R"({"enum":["stream","snapshot"],"description":"as mjpg-streamer has them"})"}}});
  routes.push_back({"GET", "/health", "Whether the program is ready; 503 while it loads", Lane::quick, "",
                    "Health", [&backend](const Request&) {
                      const Health health = backend.health();
                      Json json{{"status", health.ready ? "ready" : "loading"}};
                      if (!health.message.empty()) json["message"] = health.message;
                      return json_response(json, health.ready ? 200 : 503);
                    }});
  routes.back().open = true;
  routes.push_back({"GET", "/metrics", "Counters, as Prometheus text", Lane::quick, "",
                    "text/plain; version=0.0.4", [text = std::move(sources.metrics_text)](const Request&) {
                      Response response;
                      response.content_type = "text/plain; version=0.0.4";
                      response.body = text();
                      return response;
                    }});
  routes.push_back({"GET",
                    "/stream",
                    "The live picture: JPEG parts with Content-Length and X-Timestamp",
                    Lane::stream,
                    "",
                    "multipart/x-mixed-replace",
                    {},
                    {view}});
  // clang-format off
  const std::vector<QueryField> snapshot_fields{
      view, {"format", R"({"enum":["jpeg","png"],"default":"jpeg"})"},
      {"width", R"({"type":"integer","minimum":16,"maximum":4096})"},
      {"height", R"({"type":"integer","minimum":16,"maximum":4096})"}};
  // clang-format on
  routes.push_back({"GET", "/snapshot", "One picture of a view", Lane::scene, "", "image/jpeg",
                    [&backend](const Request& request) {
                      SnapshotRequest snapshot;
                      snapshot.view = request.query.get("view").value_or("main");
                      snapshot.format = request.query.get("format").value_or("jpeg");
                      if (snapshot.format == "jpg") snapshot.format = "jpeg";
                      if (snapshot.format != "jpeg" && snapshot.format != "png")
                        throw ApiError(400, "bad_parameter", "must be jpeg or png", "format");
                      snapshot.width = request.query.integer("width", 0, 16, 4096);
                      snapshot.height = request.query.integer("height", 0, 16, 4096);
                      Response response =
                          picture_response(backend.snapshot(snapshot), "image/" + snapshot.format);
                      response.headers.emplace_back("Cache-Control", "no-store");
                      return response;
                    },
                    snapshot_fields});
  routes.push_back({"GET", "/api/v1/openapi.json", "This document", Lane::work, "", "application/json",
                    [text = std::move(sources.openapi)](const Request&) {
                      Response response;
                      response.body = text();
                      return response;
                    }});
  routes.push_back({"GET",
                    "/api/v1/events",
                    "WebSocket: {\"type\":\"state|job|train|trace|log\",\"data\":…}; the current state first",
                    Lane::events,
                    "",
                    "Event",
                    {}});
}

}  // namespace flowscope::web
