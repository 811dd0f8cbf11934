#include "web/event_socket.h"

#include <algorithm>
#include <boost/asio/post.hpp>

namespace flowscope::web {

namespace net = boost::asio;
namespace websocket = boost::beast::websocket;
using boost::system::error_code;

namespace {

constexpr std::size_t longest_queue = 256, most_bytes = 1 << 20, largest_incoming = 4096;

/// The present state as a joiner hears it, when no event has told it yet.
std::vector<MessagePtr> present(Backend& backend) {
  std::vector<MessagePtr> messages;
  try {
    messages.push_back(to_message(backend.state()));
    for (JobStatus& job : backend.jobs()) messages.push_back(to_message(std::move(job)));
    messages.push_back(to_message(backend.train_report()));
  } catch (const std::exception& error) {
    messages.push_back(to_message(LogEvent{"warning", std::string("no state yet: ") + error.what()}));
  }
  return messages;
}

}  // namespace

EventSocket::EventSocket(net::ip::tcp::socket socket, std::shared_ptr<Context> context, PlaceHold place)
    : socket_(IncomingMeter{}, std::move(socket)),
      grace_(socket_.get_executor()),
      second_(socket_.get_executor()),
      context_(std::move(context)),
      place_(std::move(place)) {
  ++context_->counters.connections;
  ++context_->counters.sockets;
}

EventSocket::~EventSocket() {
  --context_->counters.connections;
  --context_->counters.sockets;
}

void EventSocket::start(const Upgrade& request) {
  socket_.next_layer().expires_never();  // the WebSocket's own timeouts rule from here
  websocket::stream_base::timeout timeout{};
  timeout.handshake_timeout = std::chrono::seconds(10);
  timeout.idle_timeout = std::chrono::seconds(20);
  timeout.keep_alive_pings = true;
  socket_.set_option(timeout);
  socket_.read_message_max(largest_incoming);
  socket_.auto_fragment(false);  // one message, one frame: many small ones meet delayed acknowledgements
  socket_.control_callback([this](websocket::frame_type, boost::beast::string_view payload) {
    meter().saw_control(payload.size());
  });
  socket_.async_accept(request, [self = shared_from_this()](error_code failure) {
    if (!failure) self->join();
  });
}

void EventSocket::join() {
  read();
  watch();
  if (context_->events.has_state()) return context_->events.join(shared_from_this());
  const bool posted = context_->quick.post([self = shared_from_this()] {
    auto messages = present(self->context_->backend);
    net::post(self->socket_.get_executor(), [self, messages = std::move(messages)] {
      if (self->closing_) return;
      self->context_->events.seed(messages);
      self->context_->events.join(self);
    });
  });
  if (!posted) close("the server is busy");
}

void EventSocket::read() {
  socket_.async_read(incoming_, [self = shared_from_this()](error_code failure, std::size_t) {
    if (failure) return self->drop();
    self->incoming_.clear();
    self->meter().saw_message();
    self->read();
  });
}

void EventSocket::watch() {
  second_.expires_after(std::chrono::seconds(1));
  second_.async_wait([self = shared_from_this()](error_code failure) {
    if (failure || self->closing_) return;
    // No handshake: such a client would not read its part of it either.
    if (self->meter().tick()) return self->drop();
    self->watch();
  });
}

void EventSocket::push(const MessagePtr& message) {
  if (closing_) return;
  const auto begin = waiting_.begin() + (writing_ ? 1 : 0);
  const auto same = std::find_if(begin, waiting_.end(), [&](const MessagePtr& other) {
    return !message->key.empty() && other->key == message->key;
  });
  waiting_bytes_ += message->text.size();
  if (same != waiting_.end()) {
    waiting_bytes_ -= (*same)->text.size();
    *same = message;
  } else {
    waiting_.push_back(message);
  }
  if (waiting_.size() > longest_queue || waiting_bytes_ > most_bytes)
    return close("too slow: events were waiting longer than there is room for");
  if (!writing_) write();
}

void EventSocket::write() {
  if (waiting_.empty() || closing_) return;
  writing_ = true;
  const MessagePtr message = waiting_.front();
  socket_.text(true);
  socket_.async_write(net::buffer(message->text),
                      [self = shared_from_this(), message](error_code failure, std::size_t) {
                        self->writing_ = false;
                        if (failure) return self->drop();
                        if (self->closing_) return;
                        self->waiting_bytes_ -= message->text.size();
                        self->waiting_.pop_front();
                        self->write();
                      });
}

void EventSocket::close(const std::string& reason) {
  if (closing_) return;
  closing_ = true;
  context_->events.leave(shared_from_this());
  waiting_.clear();
  grace_.expires_after(std::chrono::seconds(2));
  grace_.async_wait([self = shared_from_this()](error_code failure) {
    if (!failure) self->drop();
  });
  socket_.async_close({websocket::close_code::try_again_later, reason},
                      [self = shared_from_this()](error_code) { self->drop(); });
}

void EventSocket::drop() {
  closing_ = true;
  context_->events.leave(shared_from_this());
  grace_.cancel();
  second_.cancel();
  boost::beast::get_lowest_layer(socket_).close();
}

}  // namespace flowscope::web
