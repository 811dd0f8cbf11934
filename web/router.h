// The table of addresses: what is served, who may call it, and the schemas that the OpenAPI document prints.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "web/http.h"

namespace flowscope::web {

/// Where a call runs. Each of the first four has worker threads of its own, so that what waits for one thing
/// never holds up another: `quick` answers from memory, well within a millisecond or two; `work` computes and
/// reads files; `scene` waits for the simulator or the renderer; `slow` for the policy. `page` runs on the
/// I/O thread; `stream` and `events` take the connection over.
enum class Lane { quick, work, scene, slow, page, stream, events };

struct QueryField {
  std::string name, schema;  ///< schema: JSON text
};

struct Route {
  std::string method, pattern, summary;
  Lane lane = Lane::quick;
  std::string request;   ///< JSON schema text of the body; empty: no body
  std::string response;  ///< name of a schema, or a content type when it holds a '/'; empty: 204
  std::function<Response(const Request&)> handle;  ///< on a worker's thread
  std::vector<QueryField> query = {};
  int success = 200;
  bool open = false;  ///< answers without a token
};

struct Match {
  const Route* route = nullptr;  ///< null: nothing there, or `allow` says what is
  std::map<std::string, std::string> params;
  std::string allow;  ///< the methods that the path knows, when this one is not among them
};

class Router {
 public:
  explicit Router(std::vector<Route> routes) : routes_(std::move(routes)) {}
  /// HEAD matches GET. `path` is decoded.
  Match find(std::string_view method, std::string_view path) const;
  const std::vector<Route>& routes() const { return routes_; }

 private:
  std::vector<Route> routes_;
};

}  // namespace flowscope::web
