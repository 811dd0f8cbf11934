#include "web/mjpeg_stream.h"

#include <boost/asio/write.hpp>
#include <cstdio>

namespace flowscope::web {

namespace net = boost::asio;
using boost::system::error_code;

namespace {

constexpr std::chrono::seconds write_deadline{10}, repeat_after{1};
// The first repeat comes soon: Blink draws a part only when it has the head of the one after it, so without
// one a change of a world at rest would stay unseen for a second. Longer than the pause between pictures of a
// moving one.
constexpr std::chrono::milliseconds tick_period{250}, first_repeat_after{60};
constexpr int send_buffer_bytes = 64 * 1024;

constexpr const char* stream_head =
    "HTTP/1.1 200 OK\r\n"
    "Content-Type: multipart/x-mixed-replace; boundary=frame\r\n"
    "Cache-Control: no-store, no-cache, must-revalidate, max-age=0\r\n"
    "X-Content-Type-Options: nosniff\r\n"
    "Cross-Origin-Resource-Policy: same-origin\r\n"
    "Referrer-Policy: no-referrer\r\n"
    "Connection: close\r\n\r\n"
    "--frame\r\n";

// The next boundary goes out with the part: other readers know by it where the part ends.
constexpr std::string_view part_end = "\r\n--frame\r\n";

std::string part_head(const EncodedFrame& frame) {
  char text[128];
  std::snprintf(text, sizeof text,
                "Content-Type: image/jpeg\r\nContent-Length: %zu\r\nX-Timestamp: %.6f\r\n\r\n",
                frame.jpeg.size(), frame.timestamp_s);
  return text;
}

}  // namespace

MjpegStream::MjpegStream(net::ip::tcp::socket socket, std::shared_ptr<Context> context, PlaceHold place,
                         std::string view)
    : socket_(std::move(socket)),
      timer_(socket_.get_executor()),
      context_(std::move(context)),
      place_(std::move(place)),
      view_(std::move(view)) {
  ++context_->counters.connections;
  ++context_->counters.streams;
  error_code ignored;
  socket_.set_option(net::socket_base::send_buffer_size(send_buffer_bytes), ignored);
}

MjpegStream::~MjpegStream() {
  --context_->counters.connections;
  --context_->counters.streams;
}

void MjpegStream::start() {
  send(stream_head, nullptr);
  context_->frames.join(view_, shared_from_this());
  watch_peer();
  tick();
}

void MjpegStream::offer(const FramePtr& frame) {
  if (closed_) return;
  if (waiting_) ++context_->counters.frames_skipped;
  waiting_ = frame;
  if (!writing_) write_next();
}

void MjpegStream::write_next() {
  if (!waiting_) return;
  FramePtr frame = std::move(waiting_);
  waiting_ = nullptr;
  std::string head = part_head(*frame);
  send(std::move(head), std::move(frame));
}

void MjpegStream::send(std::string head, FramePtr frame) {
  writing_ = true;
  write_started_ = Clock::now();
  head_ = std::move(head);
  sending_ = std::move(frame);
  std::array<net::const_buffer, 3> buffers{net::buffer(head_), {}, {}};
  if (sending_) {
    buffers[1] = net::buffer(sending_->jpeg);
    buffers[2] = net::buffer(part_end.data(), part_end.size());
  }
  net::async_write(socket_, buffers, [self = shared_from_this()](error_code failure, std::size_t) {
    self->writing_ = false;
    if (failure) return self->close();
    self->write_done_ = Clock::now();
    if (self->sending_) {
      ++self->context_->counters.frames_sent;
      self->repeated_ = self->sending_ == self->last_;
      self->last_ = std::move(self->sending_);
    }
    if (self->closed_) return;
    self->write_next();
    if (!self->writing_ && self->last_ && !self->repeated_) self->tick();
  });
}

void MjpegStream::watch_peer() {
  socket_.async_read_some(net::buffer(ignored_),
                          [self = shared_from_this()](error_code failure, std::size_t) {
                            if (failure) return self->close();
                            self->watch_peer();
                          });
}

void MjpegStream::tick() {
  const bool repeat_soon = !writing_ && last_ && !repeated_;
  timer_.expires_after(repeat_soon ? first_repeat_after : tick_period);
  timer_.async_wait([self = shared_from_this()](error_code failure) {
    if (failure || self->closed_) return;
    const auto now = Clock::now();
    if (self->writing_ && now - self->write_started_ > write_deadline) return self->close();
    const auto pause = self->repeated_ ? Clock::duration(repeat_after) : Clock::duration(first_repeat_after);
    if (!self->writing_ && self->last_ && now - self->write_done_ >= pause) self->offer(self->last_);
    self->tick();
  });
}

void MjpegStream::close() {
  if (closed_) return;
  closed_ = true;
  timer_.cancel();
  error_code ignored;
  socket_.shutdown(net::ip::tcp::socket::shutdown_both, ignored);
  socket_.close(ignored);
  context_->frames.leave(view_, shared_from_this());
}

}  // namespace flowscope::web
