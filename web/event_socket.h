// One WebSocket client of /api/v1/events. I/O thread only.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/basic_stream.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <deque>
#include <memory>

#include "web/context.h"
#include "web/incoming_meter.h"

namespace flowscope::web {

/// Messages wait in a bounded queue where a newer one of the same key takes the older one's place. A client
/// that still falls behind is closed with a reason. What the client sends is read and ignored; too much of
/// it, or a message that does not end, closes it too.
class EventSocket : public EventClient, public std::enable_shared_from_this<EventSocket> {
 public:
  using Upgrade = boost::beast::http::request<boost::beast::http::string_body>;
  EventSocket(boost::asio::ip::tcp::socket socket, std::shared_ptr<Context> context, PlaceHold place);
  ~EventSocket() override;
  void start(const Upgrade& request);
  void push(const MessagePtr& message) override;
  void close(const std::string& reason) override;

 private:
  void join();
  void read();
  void watch();
  void write();
  void drop();

  using Stream =
      boost::beast::basic_stream<boost::asio::ip::tcp, boost::asio::any_io_executor, IncomingMeter>;
  IncomingMeter& meter() { return socket_.next_layer().rate_policy(); }

  boost::beast::websocket::stream<Stream> socket_;
  boost::asio::steady_timer grace_;  ///< how long a closing handshake may take
  boost::asio::steady_timer second_;
  std::shared_ptr<Context> context_;
  PlaceHold place_;
  std::deque<MessagePtr> waiting_;  ///< the first one is being written while writing_
  std::size_t waiting_bytes_ = 0;
  bool writing_ = false, closing_ = false;
  boost::beast::flat_buffer incoming_{4096};
};

}  // namespace flowscope::web
