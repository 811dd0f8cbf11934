// What every connection of one server shares. Internal to web/.
#pragma once

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <cstdint>

#include "web/event_hub.h"
#include "web/frame_hub.h"
#include "web/places.h"
#include "web/router.h"
#include "web/security.h"
#include "web/server.h"
#include "web/static_files.h"
#include "web/worker_pool.h"

namespace flowscope::web {

struct Counters {
  std::atomic<int> connections{0}, streams{0}, sockets{0};
  std::atomic<std::uint64_t> requests{0}, client_errors{0}, server_errors{0}, frames_sent{0},
      frames_skipped{0};
};

/// Hubs, places and the page belong to the I/O thread; the router is constant; pools and counters are
/// thread-safe.
struct Context {
  Context(const ServerOptions& server_options, Backend& program);

  ServerOptions options;
  Backend& backend;
  Counters counters;
  std::atomic<bool> leaving{false};  ///< calls that have not begun are told so
  Gate gate;
  StaticFiles page;
  Places places;
  WorkerPool quick{2}, work{2}, scene{2}, slow{4};
  WorkerPool notices{1, 4096};  ///< one thread: viewer counts arrive in order
  Router router;
  FrameHub frames;
  EventHub events;

  WorkerPool& pool(Lane lane);
};

/// Prometheus text.
std::string metrics_text(Backend& backend, const Counters& counters);

}  // namespace flowscope::web
