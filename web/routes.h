// Every address of the server, bound to a Backend.
#pragma once

#include <functional>

#include "web/router.h"

namespace flowscope::web {

/// `metrics_text` and `openapi` answer with what only the server knows; they are called on worker threads.
struct RouteSources {
  std::function<std::string()> metrics_text;
  std::function<std::string()> openapi;
};

std::vector<Route> make_routes(Backend& backend, RouteSources sources);

// The parts of the table, by theme.
void add_server_routes(std::vector<Route>& routes, Backend& backend, RouteSources sources);
void add_scene_routes(std::vector<Route>& routes, Backend& backend);
void add_teleop_routes(std::vector<Route>& routes, Backend& backend);
void add_policy_routes(std::vector<Route>& routes, Backend& backend);
void add_data_routes(std::vector<Route>& routes, Backend& backend);

}  // namespace flowscope::web
