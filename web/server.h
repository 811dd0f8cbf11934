// HTTP, MJPEG and WebSocket on one I/O thread (Boost.Beast); slow work on a few worker threads.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "web/backend.h"
#include "web/frame.h"

namespace flowscope::web {

struct ServerOptions {
  std::string host = "127.0.0.1";
  std::uint16_t port = 8080;   ///< 0: a free one
  std::string token;           ///< empty: no token is asked for
  std::filesystem::path page;  ///< folder of the built page; empty or missing: a plain note is served
  int max_connections = 256;   ///< a quarter of them only for those who showed the token
  int max_streams = 64;
  std::vector<std::string> names;  ///< what the server is called besides, in Host and Origin
  std::string base_path;  ///< where a proxy shows the page, as checked_base_path gives it; empty: at /
};

/// What goes to every WebSocket client. State is kept: a client that joins gets the newest of each kind
/// first.
struct LogEvent {
  std::string level, message;
};
using Event = std::variant<StateSnapshot, JobStatus, TrainReport, TraceEntry, LogEvent>;

class Server {
 public:
  /// Binds and starts its threads. Throws std::system_error naming host and port when the port is in use.
  Server(const ServerOptions& options, Backend& backend);
  ~Server();  ///< closes every connection and joins
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  std::uint16_t port() const;
  std::string url() const;  ///< http://HOST:PORT/ with ?token=… when there is one

  /// From any thread: the newest picture of a view. Each viewer gets the newest when its socket has drained.
  void publish(const std::string& view, FramePtr frame);
  /// From any thread.
  void send(Event event);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace flowscope::web
