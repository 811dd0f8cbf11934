#include "web/server.h"

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <future>
#include <map>
#include <mutex>
#include <thread>

#include "web/context.h"
#include "web/listener.h"

namespace flowscope::web {

namespace net = boost::asio;

struct Server::Impl {
  Impl(const ServerOptions& options, Backend& backend)
      : context(std::make_shared<Context>(options, backend)), listener(io, context) {
    listener.accept();
    thread = std::thread([this] { run(); });
  }

  ~Impl() {
    context->leaving = true;
    net::post(io, [this] { listener.close(); });
    // Who waits for an answer gets one, if only that there will be none.
    for (WorkerPool* pool : {&context->quick, &context->work, &context->scene, &context->slow})
      pool->finish();
    net::steady_timer answers_leave(io);
    net::post(io, [&] {
      answers_leave.expires_after(std::chrono::milliseconds(100));
      answers_leave.async_wait([this](boost::system::error_code) { close(); });
    });
    thread.join();
    context->notices.stop();
  }

  void close() {
    context->frames.close_all();
    context->events.close_all("the server stops");
    net::post(io, [this] { io.stop(); });
  }

  void run() {
    while (!io.stopped()) {
      try {
        io.run();
      } catch (const std::exception& error) {
        // One broken connection must not end the others; its session is gone with the handler.
        context->events.publish(to_message(LogEvent{"error", std::string("connection: ") + error.what()}));
      }
    }
  }

  /// Of pictures that come faster than the I/O thread takes them only the newest of each view stays.
  void publish(const std::string& view, FramePtr frame) {
    const std::lock_guard lock(mutex);
    const bool posted = !newest.empty();
    newest[view] = std::move(frame);
    if (posted) return;
    net::post(io, [this] {
      std::map<std::string, FramePtr> frames;
      {
        const std::lock_guard inner(mutex);
        frames.swap(newest);
      }
      for (const auto& [name, picture] : frames) context->frames.publish(name, picture);
    });
  }

  net::io_context io{1};  // destroyed last: pending handlers hold connections, connections hold the context
  std::shared_ptr<Context> context;
  Listener listener;
  net::executor_work_guard<net::io_context::executor_type> work{io.get_executor()};
  std::mutex mutex;
  std::map<std::string, FramePtr> newest;
  std::thread thread;
};

Server::Server(const ServerOptions& options, Backend& backend)
    : impl_(std::make_unique<Impl>(options, backend)) {}
Server::~Server() = default;

std::uint16_t Server::port() const { return impl_->listener.port(); }

std::string Server::url() const {
  const ServerOptions& options = impl_->context->options;
  const bool everywhere = options.host == "0.0.0.0" || options.host == "::";
  std::string host = everywhere ? "127.0.0.1" : options.host;
  if (host.find(':') != std::string::npos) host = "[" + host + "]";
  const std::string token = options.token.empty() ? "" : "?token=" + percent_encode(options.token);
  return "http://" + host + ":" + std::to_string(port()) + options.base_path + "/" + token;
}

void Server::publish(const std::string& view, FramePtr frame) { impl_->publish(view, std::move(frame)); }

void Server::send(Event event) {
  auto message = to_message(event);
  net::post(impl_->io,
            [impl = impl_.get(), message = std::move(message)] { impl->context->events.publish(message); });
}

}  // namespace flowscope::web
