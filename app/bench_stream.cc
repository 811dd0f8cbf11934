#include "app/bench_stream.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <string_view>
#include <thread>

#include "app/studio.h"
#include "render/renderer.h"
#include "web/server.h"

namespace flowscope {

namespace {
using Clock = std::chrono::steady_clock;

double since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

double draw_rate(const TaskLibrary& tasks, double seconds) {
  const auto task = tasks.get("push_buttons");
  World world(task);
  world.reset(0, 0);
  Renderer renderer(task->model(), task->name());
  OrbitCamera orbit;
  const SceneState state = world.state();
  renderer.draw(state, orbit.model(640, 480));  // warm-up: textures, shadow map
  int frames = 0;
  const auto start = Clock::now();
  for (; since(start) < seconds; ++frames) {
    orbit.azimuth_deg += 1;
    renderer.draw(state, orbit.model(640, 480));
  }
  return frames / since(start);
}

/// Counts the parts of one multipart stream until `stop`. Returns parts per second.
double read_stream(std::uint16_t port, const std::atomic<bool>& stop) {
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (fd < 0 || ::connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) {
    if (fd >= 0) ::close(fd);
    throw std::runtime_error("bench: cannot connect to the stream");
  }
  const timeval patience{0, 200'000};
  ::setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  const std::string request = "GET /stream HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) + "\r\n\r\n";
  if (::send(fd, request.data(), request.size(), MSG_NOSIGNAL) < 0) {
    ::close(fd);
    throw std::runtime_error("bench: cannot ask for the stream");
  }
  constexpr std::string_view mark = "X-Timestamp";
  std::string buffer(1 << 16, '\0'), tail;
  int parts = 0;
  auto start = Clock::now();
  while (!stop) {
    const auto n = ::recv(fd, buffer.data(), buffer.size(), 0);
    if (n == 0) break;
    if (n < 0) continue;
    tail.append(buffer.data(), static_cast<std::size_t>(n));
    for (std::size_t at = tail.find(mark); at != std::string::npos; at = tail.find(mark, at + mark.size())) {
      if (parts++ == 0) start = Clock::now();  // the rate counts from the first picture
    }
    tail.erase(0, tail.size() - std::min(tail.size(), mark.size() - 1));
  }
  ::close(fd);
  return parts > 1 ? (parts - 1) / since(start) : 0;
}

double slowest_viewer(Studio& studio, std::uint16_t port, int viewers, double seconds) {
  std::atomic<bool> stop{false};
  std::vector<double> rates(viewers);
  std::jthread turning([&](std::stop_token done) {
    while (!done.stop_requested()) {
      studio.drag_view("main", {"rotate", 1.0 / 180, 0});
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  });
  {
    std::vector<std::jthread> readers;
    for (int i = 0; i < viewers; ++i) readers.emplace_back([&, i] { rates[i] = read_stream(port, stop); });
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
    stop = true;
  }
  return *std::ranges::min_element(rates);
}

}  // namespace

std::vector<BenchResult> bench_stream(const std::filesystem::path& assets,
                                      const std::filesystem::path& scratch, double seconds_each) {
  std::vector<BenchResult> results;
  const TaskLibrary tasks(assets);
  const double drawn = draw_rate(tasks, seconds_each);
  results.push_back({.name = "render_only", .value = drawn, .unit = "frames/s", .ratio = {}, .against = {}});

  StudioOptions options;
  options.assets = assets;
  options.data = scratch;
  Studio studio(options);
  web::ServerOptions server_options;
  server_options.port = 0;
  web::Server server(server_options, studio);
  studio.attach(&server);
  for (const int viewers : {1, 16}) {
    const double rate = slowest_viewer(studio, server.port(), viewers, seconds_each);
    results.push_back({.name = "stream_" + std::to_string(viewers) + "_viewers",
                       .value = rate,
                       .unit = "frames/s",
                       .ratio = rate / drawn,
                       .against = "render_only"});
  }
  studio.attach(nullptr);
  return results;
}

}  // namespace flowscope
