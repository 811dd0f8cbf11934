#include "app/serve_options.h"

#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <algorithm>

#include "app/cli.h"
#include "render/descriptors.h"
#include "web/address.h"
#include "web/security.h"

namespace flowscope::app {

namespace {

constexpr int usual_descriptors = 4096, usual_connections = 256, usual_streams = 64;
constexpr int own_descriptors = 24;  ///< of drawing, recording and training at once, with some room
constexpr int fewest_connections = 8;
constexpr std::size_t short_token = 16;

void check_token(const std::string& token) {
  // What a cookie can carry.
  const bool fits = std::all_of(token.begin(), token.end(), [](char c) {
    return c > ' ' && c < 0x7f && c != '"' && c != ',' && c != ';' && c != '\\';
  });
  if (!fits)
    throw UsageError(
        "--token: use letters, digits and signs, but no space, quote, comma, semicolon or backslash");
}

int allowed_descriptors(const ServeLimits& limits) {
  const int allowed =
      set_descriptor_limit(limits.descriptors.value_or(std::max(usual_descriptors, descriptor_limit())));
  if (limits.descriptors && allowed < *limits.descriptors) {
    throw UsageError("--max-descriptors: the system allows " + std::to_string(allowed) + " (ulimit -Hn)");
  }
  const int needed = own_descriptors + fewest_connections;
  if (allowed < needed || spare_descriptors(needed) < needed) {
    throw std::runtime_error("too few file descriptors: " + std::to_string(allowed) +
                             " are allowed, serve needs at least " + std::to_string(needed) +
                             " (ulimit -n 1024 allows more)");
  }
  return allowed;
}

}  // namespace

void add_server_options(CLI::App& command, web::ServerOptions& options, ServeLimits& limits) {
  command.add_option("--host", options.host, "Address to listen on")->capture_default_str();
  command.add_option("--port", options.port, "Port to listen on; 0 takes a free one")->capture_default_str();
  command
      .add_option("--allow-host", options.names,
                  "Another name of this server, as a proxy in front of it or a user's browser has it; may be "
                  "repeated")
      ->type_name("NAME")
      ->allow_extra_args(false)
      ->delimiter(',');
  command
      .add_option("--base-path", options.base_path,
                  "Path below which a proxy shows the page, when it does not cut that path off")
      ->type_name("PATH");
  command
      .add_option("--max-connections", limits.connections,
                  "Connections at once (256); a quarter is kept for those who showed the token")
      ->type_name("N")
      ->check(CLI::Range(fewest_connections, 1 << 16));
  command.add_option("--max-streams", limits.streams, "Live pictures at once (64)")
      ->type_name("N")
      ->check(CLI::Range(1, 1 << 16));
  command
      .add_option("--max-descriptors", limits.descriptors,
                  "Files and sockets at once (4096, or the system's limit)")
      ->type_name("N")
      ->check(CLI::Range(1, 1 << 20));
}

void complete_options(web::ServerOptions& options, const ServeLimits& limits) {
  check_token(options.token);
  try {
    options.base_path = web::checked_base_path(options.base_path);
  } catch (const std::invalid_argument& error) {
    throw UsageError(std::string("--base-path: ") + error.what());
  }
  try {
    web::Gate(options.host, options.token, options.names);
  } catch (const std::invalid_argument& error) {
    throw UsageError(std::string("--allow-host: ") + error.what());
  }
  const int room = allowed_descriptors(limits) - own_descriptors;
  const int streams = limits.streams.value_or(usual_streams);
  options.max_connections = limits.connections.value_or(std::max(usual_connections, streams + usual_streams));
  if (options.max_connections > room) {
    const std::string few = "too few file descriptors for " + std::to_string(options.max_connections) +
                            " connections: " + std::to_string(room + own_descriptors) +
                            " are allowed, which is enough for " + std::to_string(room);
    if (limits.connections)
      throw UsageError("--max-connections: " + few + "; raise --max-descriptors or ulimit -n");
    spdlog::warn("{} (ulimit -n 1024 allows more)", few);
    options.max_connections = room;
  }
  if (limits.streams && streams > options.max_connections) {
    throw UsageError("--max-streams: more streams than connections (" +
                     std::to_string(options.max_connections) + ")");
  }
  options.max_streams = std::min(streams, options.max_connections);
}

std::vector<std::string> server_warnings(const web::ServerOptions& options) {
  std::vector<std::string> warnings;
  const bool local = web::is_loopback_host(options.host);
  const std::string where = "listening on " + options.host;
  if (options.token.empty() && local) {
    warnings.push_back("no token: every user and every program of this machine can use this server");
  } else if (options.token.empty()) {
    warnings.push_back(where + " without a token: everyone who reaches this machine can use this server");
  } else if (!local) {
    warnings.push_back(where +
                       ": everyone who reaches this machine can knock; only the token keeps them out, and it "
                       "travels unencrypted");
  }
  if (!options.token.empty() && options.token.size() < short_token) {
    warnings.push_back("--token has " + std::to_string(options.token.size()) +
                       " characters and can be guessed: give at least " + std::to_string(short_token) +
                       ", or none, then a random one is made");
  }
  return warnings;
}

}  // namespace flowscope::app
