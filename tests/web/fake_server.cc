// The real server over a fake program: the page can be worked on without simulator, renderer or policy.
#include <csignal>
#include <iostream>
#include <string>
#include <thread>

#include "tests/support/fake_backend.h"
#include "web/server.h"

namespace {
volatile std::sig_atomic_t stopped = 0;
}

int main(int argc, char** argv) {
  using namespace flowscope;
  web::ServerOptions options;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string name = argv[i], value = argv[i + 1];
    if (name == "--port") options.port = static_cast<std::uint16_t>(std::stoi(value));
    if (name == "--page") options.page = value;
    if (name == "--token") options.token = value;
    if (name == "--base-path") options.base_path = value;
    if (name == "--allow-host") options.names.push_back(value);
  }
  std::signal(SIGINT, [](int) { stopped = 1; });
  std::signal(SIGTERM, [](int) { stopped = 1; });
  try {
    testing::FakeBackend backend;
    web::Server server(options, backend);
    backend.on_event = [&server](web::Event event) { server.send(std::move(event)); };
    std::cout << "flowscope: " << server.url() << std::endl;
    for (std::uint64_t sequence = 1; !stopped; ++sequence) {
      server.publish("main", backend.tick(sequence));
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  } catch (const std::exception& error) {
    std::cerr << "flowscope: " << error.what() << "\n";
    return 1;
  }
}
