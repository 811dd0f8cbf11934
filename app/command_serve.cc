// flowscope serve: the page, the stream and the API until a signal ends them.
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <mutex>
#include <random>
#include <stop_token>
#include <thread>

#include "app/cli.h"
#include "app/commands.h"
#include "app/data_lock.h"
#include "app/memory.h"
#include "app/scene_options.h"
#include "app/serve_options.h"
#include "app/studio.h"
#include "web/server.h"

namespace flowscope::app {
namespace {

constexpr std::chrono::milliseconds most_patience{3000};

struct ServeCall {
  web::ServerOptions server;
  ServeLimits limits;
  StudioOptions studio;
  std::string token;
  bool no_token = false;
  std::filesystem::path page;
  SceneCall scene;
};

/// 128 bits from the operating system, hexadecimal.
std::string random_token() {
  std::random_device device;
  std::string token;
  char part[9];
  for (int i = 0; i < 4; ++i) {
    std::snprintf(part, sizeof part, "%08x", device());
    token += part;
  }
  return token;
}

std::filesystem::path find_page() {
  if (const char* given = std::getenv("FLOWSCOPE_PAGE")) return given;
  return find_assets().parent_path() / "web" / "ui" / "dist";
}

/// Whatever cannot be interrupted must not hold the end up: files appear whole or not at all.
void end_in_time(const std::stop_token& ended) {
  std::mutex mutex;
  std::unique_lock lock(mutex);
  std::condition_variable_any never;
  if (never.wait_for(lock, ended, most_patience, [] { return false; }) || ended.stop_requested()) return;
  std::fputs("flowscope: something could not be interrupted; ending without it\n", stderr);
  std::_Exit(1);
}

int serve(const ServeCall& call, const Context& context) {
  limit_arenas();
  // stdout carries the one ready line
  spdlog::set_default_logger(
      std::make_shared<spdlog::logger>("flowscope", std::make_shared<spdlog::sinks::stderr_color_sink_mt>()));
  web::ServerOptions options = call.server;
  options.page = find_page();
  if (call.no_token) {
    options.token.clear();
  } else {
    options.token = call.token.empty() ? random_token() : call.token;
  }
  complete_options(options, call.limits);
  StudioOptions studio_options = call.studio;
  studio_options.assets = find_assets();
  studio_options.data = context.data;
  if (!call.scene.scene.empty()) {
    studio_options.scene = open_scene(call.scene, studio_options.assets);
    studio_options.task = studio_options.scene->name();
  }

  // Signals are waited for, not handled: block them before any thread starts, so that every thread inherits
  // that.
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);

  const FileLock data_lock = lock_data(context.data, "serve");
  const FileLock policy_lock = lock_policy(context.data / "policies" / "live.flow", "serve");
  std::unique_ptr<Studio> studio;
  try {
    studio = std::make_unique<Studio>(studio_options);
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
  auto server = std::make_unique<web::Server>(options, *studio);
  studio->attach(server.get());
  for (const std::string& warning : server_warnings(options))
    std::fprintf(stderr, "flowscope: WARNING: %s\n", warning.c_str());
  std::printf("flowscope: %s\n", server->url().c_str());
  std::fflush(stdout);

  int signal = 0;
  sigwait(&signals, &signal);
  pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);  // a second signal ends the program at once
  std::fprintf(stderr, "flowscope: ending\n");
  const std::jthread impatience(end_in_time);
  studio->attach(nullptr);
  studio->leave();
  server.reset();
  studio.reset();
  return 0;
}

}  // namespace

void add_serve_command(CLI::App& root, Context& context) {
  CLI::App* command = root.add_subcommand("serve", "Start the server; open the printed address in a browser");
  auto call = std::make_shared<ServeCall>();
  add_server_options(*command, call->server, call->limits);
  add_data_option(*command, context);
  add_egl_option(*command, context);
  CLI::Option* task = command->add_option("--task", call->studio.task, "Task to open")->capture_default_str();
  add_scene_options(*command, call->scene)->excludes(task);
  command->add_option("--policy", call->studio.policy, "Trained policy to predict with");
  CLI::Option* token =
      command->add_option("--token", call->token, "Token that clients must show; random by default");
  command->add_flag("--no-token", call->no_token, "Ask nobody for a token")->excludes(token);
  set_body(*command, context, [call, &context] { return serve(*call, context); });
}

}  // namespace flowscope::app
