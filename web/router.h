// The table of addresses: what is served, who may call it, and the schemas that the OpenAPI document prints.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "web/http.h"

namespace flowscope::web {

/// Where a call runs: `quick` and `slow` on worker threads of their own, so that long predictions never hold
/// up the state; `page` on the I/O thread; `stream` and `events` take the connection over.
enum class Lane { quick, slow, page, stream, events };

struct QueryField {
  std::string name, schema;  ///< schema: JSON text
};

struct Route {
  std::string method, pattern, summary;
  Lane lane = Lane::quick;
  std::string request;   ///< JSON schema text of the body; empty: no body
  std::string response;  ///< name of a schema, or a content type when it holds a '/'; empty: 204
  std::function<Response(const Request&)> handle;  ///< quick and slow lanes
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
