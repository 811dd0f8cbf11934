#include "web/context.h"

#include <nlohmann/json.hpp>

#include "web/openapi.h"
#include "web/routes.h"

namespace flowscope::web {

Context::Context(const ServerOptions& server_options, Backend& program)
    : options(server_options),
      backend(program),
      gate(options.host, options.token, options.names, options.base_path),
      page(options.page),
      places(options.max_connections, options.max_connections / 4),
      router(make_routes(program,
                         {[this] { return metrics_text(backend, counters); },
                          [this] { return wire::dump(openapi(router.routes(), gate.cookie_name())); }})),
      frames([this](const std::string& view, int viewers) {
        notices.post([this, view, viewers] {
          try {
            backend.viewers_changed(view, viewers);
          } catch (const std::exception&) {
            // A view that went away meanwhile has nobody left to tell.
          }
        });
      }) {}

WorkerPool& Context::pool(Lane lane) {
  if (lane == Lane::slow) return slow;
  if (lane == Lane::scene) return scene;
  return lane == Lane::work ? work : quick;
}

namespace {

void add_metric(std::string& text, const std::string& name, const char* type, const char* help,
                std::uint64_t value) {
  const std::string full = "flowscope_" + name;
  text += "# HELP " + full + " " + help + "\n# TYPE " + full + " " + type + "\n" + full + " " +
          std::to_string(value) + "\n";
}

}  // namespace

std::string metrics_text(Backend& backend, const Counters& counters) {
  const Metrics program = backend.metrics();
  std::string text;
  const auto count = [&](const char* name, const char* help, std::uint64_t value) {
    add_metric(text, name, "counter", help, value);
  };
  const auto gauge = [&](const char* name, const char* help, int value) {
    add_metric(text, name, "gauge", help, static_cast<std::uint64_t>(std::max(value, 0)));
  };
  gauge("ready", "1 when the program is ready", backend.health().ready);
  count("frames_rendered_total", "Pictures rendered", program.frames_rendered);
  count("frames_encoded_total", "Pictures encoded as JPEG", program.frames_encoded);
  count("predictions_total", "Predictions made", program.predictions);
  count("train_steps_total", "Optimiser steps", program.train_steps);
  count("http_requests_total", "Requests answered", counters.requests);
  count("http_client_errors_total", "Answers 4xx", counters.client_errors);
  count("http_server_errors_total", "Answers 5xx", counters.server_errors);
  count("stream_frames_sent_total", "Pictures sent to stream viewers", counters.frames_sent);
  count("stream_frames_skipped_total", "Pictures that a slow viewer missed", counters.frames_skipped);
  gauge("connections", "Open connections", counters.connections);
  gauge("stream_viewers", "Open streams", counters.streams);
  gauge("event_clients", "Open WebSockets", counters.sockets);
  return text;
}

}  // namespace flowscope::web
