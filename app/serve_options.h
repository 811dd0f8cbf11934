// What a call of serve may ask for, and what its user must be told about it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "web/server.h"

namespace CLI {
class App;
}

namespace flowscope::app {

struct ServeLimits {
  std::optional<int> connections, streams, descriptors;  ///< empty: the defaults, as far as descriptors reach
};

/// --host, --port, --allow-host, --base-path and the limits.
void add_server_options(CLI::App& command, web::ServerOptions& options, ServeLimits& limits);

/// Completes what the call left open and checks the rest. Throws UsageError naming the option, and
/// std::runtime_error when the system allows too few descriptors. Raises the process's limit of descriptors.
void complete_options(web::ServerOptions& options, const ServeLimits& limits);

/// Who can reach the server and what keeps them out, when that is less than loopback and a long token.
std::vector<std::string> server_warnings(const web::ServerOptions& options);

}  // namespace flowscope::app
